//! Keys on where mesh points lie, which the direct and the indirect light mesh share.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use toml::Spanned;

use super::place::Places;
use super::values::{Lengths, LengthsOrAuto, Point, Positive};
use crate::Bounds;
use crate::scene::load::LoadError;
use crate::scene::load::points::load_points;
use crate::settings::{
    KernelSettings, LayoutName, Leaks, Neighbourhood, PointLayout, PointSettings, Radius, Region, Spacing,
};

/// Defines a table that has the point keys beside its own. (serde can't flatten a struct into one that
/// refuses unknown keys.)
macro_rules! point_table {
    ($(#[$meta:meta])* pub struct $name:ident { $($field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($field: $type,)*
            layout: Option<$crate::settings::LayoutName>,
            layout_seed: Option<Spanned<u32>>,
            points_file: Option<Spanned<std::path::PathBuf>>,
            spacing: Option<$crate::scene::load::scene_file::values::LengthsOrAuto>,
            radius: Option<Spanned<$crate::scene::load::scene_file::values::Positive>>,
            radius_in_spacings: Option<$crate::scene::load::scene_file::values::Positive>,
            neighbourhood: Option<$crate::settings::Neighbourhood>,
            hemisphere: Option<bool>,
            leaks: Option<$crate::settings::Leaks>,
            #[serde(default)]
            region: Vec<Spanned<$crate::scene::load::scene_file::points::RegionTable>>,
        }

        impl $name {
            fn point_keys(&self, table: &'static str) -> PointKeys<'_> {
                PointKeys {
                    table,
                    layout: self.layout,
                    layout_seed: self.layout_seed.as_ref(),
                    points_file: self.points_file.as_ref(),
                    spacing: self.spacing,
                    radius: self.radius.as_ref(),
                    radius_in_spacings: self.radius_in_spacings,
                    neighbourhood: self.neighbourhood,
                    hemisphere: self.hemisphere,
                    leaks: self.leaks,
                    region: &self.region,
                }
            }
        }
    };
}
pub(super) use point_table;

/// The point keys of one table, as given.
pub struct PointKeys<'a> {
    /// The table's name.
    pub table: &'static str,
    pub layout: Option<LayoutName>,
    pub layout_seed: Option<&'a Spanned<u32>>,
    pub points_file: Option<&'a Spanned<PathBuf>>,
    pub spacing: Option<LengthsOrAuto>,
    pub radius: Option<&'a Spanned<Positive>>,
    pub radius_in_spacings: Option<Positive>,
    pub neighbourhood: Option<Neighbourhood>,
    pub hemisphere: Option<bool>,
    pub leaks: Option<Leaks>,
    pub region: &'a [Spanned<RegionTable>],
}

/// `[[light_mesh.region]]`
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionTable {
    min: Point,
    max: Point,
    spacing: Option<Lengths>,
    radius: Option<Positive>,
}

impl PointKeys<'_> {
    /// Puts what is given in place of what `settings` and `kernel` hold; files lie in `folder`.
    pub fn apply(
        &self,
        settings: &mut PointSettings,
        kernel: &mut KernelSettings,
        folder: &Path,
        places: &Places,
    ) -> Result<(), LoadError> {
        self.apply_layout(settings, folder, places)?;
        match self.spacing {
            None => {}
            Some(LengthsOrAuto::Auto) => settings.spacing = Spacing::Auto,
            Some(LengthsOrAuto::Lengths(lengths)) => settings.spacing = Spacing::Units(lengths),
        }
        match (self.radius, self.radius_in_spacings) {
            (None, None) => {}
            (Some(radius), None) => kernel.radius = Radius::Units(radius.get_ref().0),
            (None, Some(radius)) => kernel.radius = Radius::Spacings(radius.0),
            (Some(radius), Some(_)) => {
                let problem = "radius and radius_in_spacings exclude each other";
                return Err(places.error(&radius.span(), &self.key("radius"), problem));
            }
        }
        kernel.neighbourhood = self.neighbourhood.unwrap_or(kernel.neighbourhood);
        kernel.hemisphere = self.hemisphere.unwrap_or(kernel.hemisphere);
        kernel.leaks = self.leaks.unwrap_or(kernel.leaks);
        if !self.region.is_empty() {
            let regions = self.region.iter().enumerate();
            settings.regions = regions
                .map(|(index, region)| self.region(index, region, places))
                .collect::<Result<_, _>>()?;
        }
        Ok(())
    }

    fn apply_layout(
        &self,
        settings: &mut PointSettings,
        folder: &Path,
        places: &Places,
    ) -> Result<(), LoadError> {
        if let Some(file) = self.points_file {
            let error = |problem: String| places.error(&file.span(), &self.key("points_file"), problem);
            if self.layout.is_some() {
                return Err(error("excludes layout".to_owned()));
            }
            let path = folder.join(file.get_ref());
            let points = load_points(&path).map_err(|problem| match problem {
                LoadError::Read { source, .. } => {
                    places.unreadable(&file.span(), &self.key("points_file"), path.clone(), source)
                }
                other => other,
            })?;
            settings.layout = PointLayout::List(Arc::new(points));
        }
        let seed = u64::from(self.layout_seed.map_or(0, |seed| *seed.get_ref()));
        if let Some(name) = self.layout {
            settings.layout = PointLayout::of_name(name, seed);
        }
        if let Some(seed) = self.layout_seed
            && !matches!(self.layout, Some(LayoutName::Jittered | LayoutName::BlueNoise))
        {
            let problem = "needs layout = \"jittered\" or \"blue-noise\"";
            return Err(places.error(&seed.span(), &self.key("layout_seed"), problem));
        }
        Ok(())
    }

    fn region(
        &self,
        index: usize,
        region: &Spanned<RegionTable>,
        places: &Places,
    ) -> Result<Region, LoadError> {
        let error =
            |problem| Err(places.error(&region.span(), &self.key(&format!("region[{index}]")), problem));
        let RegionTable { min, max, spacing, radius } = region.get_ref();
        if !min.0.cmplt(max.0).all() {
            return error("min must be less than max in every component");
        }
        if spacing.is_none() && radius.is_none() {
            return error("needs spacing or radius");
        }
        Ok(Region {
            bounds: Bounds { min: min.0, max: max.0 },
            spacing: spacing.map(|lengths| lengths.0),
            radius: radius.map(|radius| radius.0),
        })
    }

    fn key(&self, name: &str) -> String {
        format!("{}.{name}", self.table)
    }
}
