//! The choice of a backend at run time.

use std::fmt;

use pulp::NullaryFnOnce;

use super::{Accel, BruteForceAccel, BvhAccel, BvhError, Coherence, LaneMask, RayHitPacket, RayPacket};
#[cfg(feature = "embree")]
use super::{EmbreeAccel, EmbreeError};
use crate::scene::{Hit, Ray, Scene};
use crate::settings::{Named, named_enum};
use crate::simd::vectorize;

named_enum! {
    /// What the user asks for.
    #[derive(Default)]
    pub enum BackendChoice {
        /// Embree where it is installed, the pure-Rust BVH elsewhere
        #[default]
        Auto = "auto",
        /// Embree; an error where there is none
        Embree = "embree",
        /// The pure-Rust BVH
        Bvh = "bvh",
        /// A loop over all triangles, for tests
        BruteForce = "brute-force",
    }
}

/// The Embree libraries that are installed, the one that is taken first: version and name of each.
///
/// # Errors
/// Why there is none that can be used, in one line.
pub fn embree_libraries() -> Result<Vec<String>, String> {
    #[cfg(feature = "embree")]
    {
        let libraries =
            embree_sys::Library::load_all().map_err(|error| error.to_string().replace('\n', " "))?;
        Ok(libraries.iter().map(|library| format!("{} ({})", library.version(), library.name())).collect())
    }
    #[cfg(not(feature = "embree"))]
    Err("this build has no Embree support".to_owned())
}

/// An acceleration structure of one of the backends.
///
/// A `Backend` is an [`Accel`] that looks up its variant in every call, which takes little beside tracing a packet of rays.
/// Rendering is generic over [`Accel`], but compiled for a `Backend` alone: a copy for each variant took two thirds of the time
/// to compile and gained nothing that could be measured. Benchmarks of backends look the variant up once.
pub enum Backend {
    /// Debian's Embree.
    #[cfg(feature = "embree")]
    Embree(EmbreeAccel),
    /// The pure-Rust BVH.
    Bvh(Box<BvhAccel>),
    /// A loop over all triangles.
    BruteForce(BruteForceAccel),
}

/// Why no acceleration structure could be built.
#[derive(Debug, thiserror::Error)]
pub enum BackendError {
    /// Embree was requested, and either isn't there or failed.
    #[cfg(feature = "embree")]
    #[error("backend embree: {0}")]
    Embree(#[from] EmbreeError),
    /// Embree was requested from a build without it.
    #[cfg(not(feature = "embree"))]
    #[error("backend embree: this build has no Embree support; build with the default features")]
    NoEmbreeSupport,
    /// The BVH could not be built.
    #[error("backend bvh: {0}")]
    Bvh(#[from] BvhError),
}

/// Runs `$body` with `$accel` bound to the backend's own type, so that everything within is dispatched statically.
macro_rules! with_accel {
    ($backend:expr, $accel:ident => $body:expr) => {
        match $backend {
            #[cfg(feature = "embree")]
            $crate::accel::Backend::Embree($accel) => $body,
            $crate::accel::Backend::Bvh(boxed) => {
                let $accel = &**boxed;
                $body
            }
            $crate::accel::Backend::BruteForce($accel) => $body,
        }
    };
}
#[cfg(feature = "cli")]
pub(crate) use with_accel;

/// A backend, and what the user should know about the choice.
pub struct Chosen {
    /// The acceleration structure.
    pub backend: Backend,
    /// Why `auto` did not take Embree.
    pub notice: Option<String>,
}

impl Backend {
    /// Builds the acceleration structure of a scene.
    ///
    /// # Errors
    /// Embree requested by name and not available, or a failed build. `auto` falls back only where no Embree
    /// library can be used at all; one that fails on this scene is an error.
    pub fn build(choice: BackendChoice, scene: &Scene) -> Result<Chosen, BackendError> {
        let plain = |backend| Ok(Chosen { backend, notice: None });
        match choice {
            BackendChoice::Bvh => plain(Self::Bvh(Box::new(BvhAccel::build(scene)?))),
            BackendChoice::BruteForce => plain(Self::BruteForce(BruteForceAccel::new(scene))),
            #[cfg(feature = "embree")]
            BackendChoice::Embree => plain(Self::Embree(EmbreeAccel::build(scene)?)),
            #[cfg(feature = "embree")]
            BackendChoice::Auto => match EmbreeAccel::build(scene) {
                Ok(accel) => plain(Self::Embree(accel)),
                // A library that the user named has to work.
                Err(EmbreeError::Library(cause)) if std::env::var_os("EMBREE_LIB").is_none() => {
                    let notice = format!(
                        "{cause}; using the built-in BVH. To use Embree, install the package \
                         libembree3-3 (Debian 12) or libembree4-4 (Debian 13)"
                    );
                    Ok(Chosen { backend: Self::Bvh(Box::new(BvhAccel::build(scene)?)), notice: Some(notice) })
                }
                Err(error) => Err(error.into()),
            },
            #[cfg(not(feature = "embree"))]
            BackendChoice::Embree => Err(BackendError::NoEmbreeSupport),
            #[cfg(not(feature = "embree"))]
            BackendChoice::Auto => {
                let notice = "this build has no Embree support; using the built-in BVH".to_owned();
                Ok(Chosen { backend: Self::Bvh(Box::new(BvhAccel::build(scene)?)), notice: Some(notice) })
            }
        }
    }

    /// Makes it the acceleration structure of a scene that differs only in where instances stand.
    ///
    /// The BVH keeps the trees of meshes, Embree those of placed ones.
    ///
    /// # Errors
    /// As for [`Backend::build`]; then it is what it was.
    pub fn rebuild(&mut self, scene: &Scene) -> Result<(), BackendError> {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(accel) => accel.rebuild(scene)?,
            Self::Bvh(accel) => accel.rebuild(scene)?,
            Self::BruteForce(accel) => *accel = BruteForceAccel::new(scene),
        }
        Ok(())
    }

    /// Builds every backend that is available: the BVH, then Embree in every version that is installed. Where there is
    /// none, the text is the reason.
    ///
    /// # Errors
    /// As for [`Backend::build`].
    pub fn build_all(scene: &Scene) -> Result<(Vec<Self>, Option<String>), BackendError> {
        let mut backends = vec![Self::build(BackendChoice::Bvh, scene)?.backend];
        let chosen = Self::build(BackendChoice::Auto, scene)?;
        if chosen.notice.is_none() {
            backends.push(chosen.backend);
            #[cfg(feature = "embree")]
            for accel in EmbreeAccel::build_others(scene)? {
                backends.push(Self::Embree(accel));
            }
        }
        Ok((backends, chosen.notice))
    }

    /// Name as on the command line.
    pub fn name(&self) -> &'static str {
        let choice = match self {
            #[cfg(feature = "embree")]
            Self::Embree(_) => BackendChoice::Embree,
            Self::Bvh(_) => BackendChoice::Bvh,
            Self::BruteForce(_) => BackendChoice::BruteForce,
        };
        choice.name()
    }

    /// Version of the library behind it.
    pub fn version(&self) -> String {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(accel) => accel.version(),
            _ => env!("CARGO_PKG_VERSION").to_owned(),
        }
    }
}

impl Accel for Backend {
    #[inline(never)]
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        with_accel!(self, accel => accel.intersect(ray))
    }

    #[inline(never)]
    fn occluded(&self, ray: &Ray) -> bool {
        with_accel!(self, accel => accel.occluded(ray))
    }

    #[inline(never)]
    fn intersect_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayHitPacket<N>,
        coherence: Coherence,
    ) {
        vectorize(IntersectPacket { backend: self, active, packet, coherence });
    }

    #[inline(never)]
    fn occluded_packet<const N: usize>(
        &self,
        active: LaneMask,
        packet: &mut RayPacket<N>,
        coherence: Coherence,
    ) -> LaneMask {
        vectorize(OccludedPacket { backend: self, active, packet, coherence })
    }

    fn memory_bytes(&self) -> usize {
        with_accel!(self, accel => accel.memory_bytes())
    }
}

/// A query of [`Accel::intersect_packet`], as work for the best instruction set: what Embree gets is made ready sixteen rays at a time.
struct IntersectPacket<'a, const N: usize> {
    backend: &'a Backend,
    active: LaneMask,
    packet: &'a mut RayHitPacket<N>,
    coherence: Coherence,
}

impl<const N: usize> NullaryFnOnce for IntersectPacket<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { backend, active, packet, coherence } = self;
        with_accel!(backend, accel => accel.intersect_packet(active, packet, coherence));
    }
}

/// The same of [`Accel::occluded_packet`].
struct OccludedPacket<'a, const N: usize> {
    backend: &'a Backend,
    active: LaneMask,
    packet: &'a mut RayPacket<N>,
    coherence: Coherence,
}

impl<const N: usize> NullaryFnOnce for OccludedPacket<'_, N> {
    type Output = LaneMask;

    #[inline(always)]
    fn call(self) -> LaneMask {
        let Self { backend, active, packet, coherence } = self;
        with_accel!(backend, accel => accel.occluded_packet(active, packet, coherence))
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name(), self.version())
    }
}
