//! Ray and hit packets in Embree's memory layout: plain data, no foreign functions.
//!
//! Every backend works on these types, so that handing a packet to Embree copies nothing. The
//! layout is that of `RTCRayN` and `RTCRayHitN` of Embree 4.3, the larger of the two; Embree 3 reads
//! and writes a prefix of it.

/// Id that stands for "nothing was hit" (`RTC_INVALID_GEOMETRY_ID`).
pub const INVALID_ID: u32 = u32::MAX;

/// Largest magnitude of a coordinate that Embree works with (its `FLT_LARGE`). Triangles that reach
/// beyond it are left out of a scene; Debian's builds abort on rays that start or point beyond it.
pub const MAX_COORDINATE: f32 = 1.844e18;

/// A ray whose direction has no component of at least this size has none: Embree takes components below 10⁻¹⁸ for
/// that much, which must stay far below the rounding of the others.
pub const MIN_DIRECTION: f32 = 1e-10;

/// Whether a ray can hit anything: origin and direction lie within ±`largest` (so they aren't NaN), the direction is
/// not shorter than [`MIN_DIRECTION`], and the interval is one: `tnear` ≤ `tfar` and 0 ≤ `tfar`.
#[inline(always)]
pub fn is_valid_ray(origin: [f32; 3], direction: [f32; 3], [tnear, tfar]: [f32; 2], largest: f32) -> bool {
    // No branches, so that loops over lanes vectorise.
    let ([ox, oy, oz], [dx, dy, dz]) = (origin, direction);
    let within = (ox.abs() <= largest)
        & (oy.abs() <= largest)
        & (oz.abs() <= largest)
        & (dx.abs() <= largest)
        & (dy.abs() <= largest)
        & (dz.abs() <= largest);
    let long = (dx.abs() >= MIN_DIRECTION) | (dy.abs() >= MIN_DIRECTION) | (dz.abs() >= MIN_DIRECTION);
    let interval = (tfar >= tnear) & (tfar >= 0.0);
    within & long & interval
}

/// Packet of `N` rays as a structure of arrays, `N` being 4, 8 or 16 (`RTCRay4`, `RTCRay8`, `RTCRay16`).
///
/// A ray is `org + t * dir` for `tnear <= t <= tfar`; `dir` need not be normalised, `t` is in units of
/// its length. Lanes are switched off by the mask that goes with a query, not by their contents.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct RayPacket<const N: usize> {
    /// Origins, x.
    pub org_x: [f32; N],
    /// Origins, y.
    pub org_y: [f32; N],
    /// Origins, z.
    pub org_z: [f32; N],
    /// Start of the valid interval of t.
    pub tnear: [f32; N],
    /// Directions, x.
    pub dir_x: [f32; N],
    /// Directions, y.
    pub dir_y: [f32; N],
    /// Directions, z.
    pub dir_z: [f32; N],
    /// Time for motion blur; unused, 0.
    pub time: [f32; N],
    /// End of the valid interval of t. A closest-hit query lowers it to the hit; an occlusion query
    /// sets it to −∞ where the ray is blocked.
    pub tfar: [f32; N],
    /// Ray masks, −1 (all bits): Embree 4 compares them with the geometry's mask.
    pub mask: [u32; N],
    /// Free for the caller.
    pub id: [u32; N],
    /// Reserved by Embree, 0.
    pub flags: [u32; N],
}

/// Hits of a packet (`RTCHitN` of Embree 4.3).
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct HitPacket<const N: usize> {
    /// Unnormalised geometric normal, x; not filled by every backend.
    pub ng_x: [f32; N],
    /// Unnormalised geometric normal, y.
    pub ng_y: [f32; N],
    /// Unnormalised geometric normal, z.
    pub ng_z: [f32; N],
    /// Barycentric coordinate of the triangle's second vertex.
    pub u: [f32; N],
    /// Barycentric coordinate of the triangle's third vertex.
    pub v: [f32; N],
    /// Triangle within the geometry.
    pub prim_id: [u32; N],
    /// Geometry within the scene (or within the instanced scene), [`INVALID_ID`] for a miss.
    pub geom_id: [u32; N],
    /// Instance within the scene, [`INVALID_ID`] for geometry that is not instanced.
    pub inst_id: [u32; N],
    /// Index within an instance array; written by Embree 4.3 and later only.
    pub inst_prim_id: [u32; N],
}

/// A ray packet followed by its hits (`RTCRayHit4`, `RTCRayHit8`, `RTCRayHit16`).
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct RayHitPacket<const N: usize> {
    /// The rays.
    pub ray: RayPacket<N>,
    /// What they hit.
    pub hit: HitPacket<N>,
}

impl<const N: usize> RayPacket<N> {
    /// A packet whose lanes are all inactive in effect: zero direction, empty interval.
    pub const fn empty() -> Self {
        Self {
            org_x: [0.0; N],
            org_y: [0.0; N],
            org_z: [0.0; N],
            tnear: [0.0; N],
            dir_x: [0.0; N],
            dir_y: [0.0; N],
            dir_z: [0.0; N],
            time: [0.0; N],
            tfar: [f32::NEG_INFINITY; N],
            mask: [u32::MAX; N],
            id: [0; N],
            flags: [0; N],
        }
    }

    /// Which lanes hold a [valid ray](is_valid_ray): −1 for those, 0 for the others.
    #[inline(always)]
    pub fn valid_lanes(&self, largest: f32) -> [i32; N] {
        let mut valid = [0; N];
        for (lane, valid) in valid.iter_mut().enumerate() {
            let origin = [self.org_x[lane], self.org_y[lane], self.org_z[lane]];
            let direction = [self.dir_x[lane], self.dir_y[lane], self.dir_z[lane]];
            *valid =
                -i32::from(is_valid_ray(origin, direction, [self.tnear[lane], self.tfar[lane]], largest));
        }
        valid
    }
}

impl<const N: usize> RayHitPacket<N> {
    /// [`RayPacket::empty`] with no hits.
    pub const fn empty() -> Self {
        Self {
            ray: RayPacket::empty(),
            hit: HitPacket {
                ng_x: [0.0; N],
                ng_y: [0.0; N],
                ng_z: [0.0; N],
                u: [0.0; N],
                v: [0.0; N],
                prim_id: [INVALID_ID; N],
                geom_id: [INVALID_ID; N],
                inst_id: [INVALID_ID; N],
                inst_prim_id: [INVALID_ID; N],
            },
        }
    }
}
