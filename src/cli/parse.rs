//! Numbers on the command line, with the ranges that they must lie in.

use std::str::FromStr;
use std::time::Duration;

use glam::Vec3;

use crate::Bounds;
use crate::image::MAX_PIXELS;
use crate::settings::{MAX_EXPOSURE, MAX_FILTER_WIDTH, Radius, Spacing};

/// Largest width and height of an image.
const MAX_SIDE: u32 = 1 << 16;

/// A finite number for which `holds`; `wanted` says in words what that is.
fn number<T: FromStr + Copy + Into<f64>>(
    text: &str,
    wanted: &str,
    holds: impl Fn(f64) -> bool,
) -> Result<T, String> {
    match text.trim().parse::<T>() {
        Ok(value) if value.into().is_finite() && holds(value.into()) => Ok(value),
        _ => Err(format!("`{text}` is not {wanted}")),
    }
}

/// A number above 0.
pub fn positive<T: FromStr + Copy + Into<f64>>(text: &str) -> Result<T, String> {
    number(text, "a number above 0", |value| value > 0.0)
}

/// A number that is not below 0.
pub fn non_negative<T: FromStr + Copy + Into<f64>>(text: &str) -> Result<T, String> {
    number(text, "a number from 0 up", |value| value >= 0.0)
}

/// Width of a pixel filter.
pub fn filter_width(text: &str) -> Result<f32, String> {
    let wanted = format!("a number above 0, at most {MAX_FILTER_WIDTH}");
    number(text, &wanted, |width| width > 0.0 && width <= f64::from(MAX_FILTER_WIDTH))
}

/// Stops of exposure.
pub fn exposure(text: &str) -> Result<f32, String> {
    let wanted = format!("a number from −{MAX_EXPOSURE} to {MAX_EXPOSURE}");
    number(text, &wanted, |stops| stops.abs() <= f64::from(MAX_EXPOSURE))
}

/// Width and height of an image in pixels.
pub fn resolution(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    match sides {
        Some((width, height)) if u64::from(width) * u64::from(height) <= MAX_PIXELS => Ok((width, height)),
        Some(_) => Err(format!("more than {MAX_PIXELS} pixels")),
        None => Err(format!("width and height from 1 to {MAX_SIDE}, such as 640x480")),
    }
}

/// Three coordinates.
pub fn point(text: &str) -> Result<Vec3, String> {
    let numbers: Result<Vec<f32>, _> =
        text.split(',').map(|text| number(text, "a number", |_| true)).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) => Ok(Vec3::new(x, y, z)),
        _ => Err("three numbers, such as 0,1.5,-2".to_owned()),
    }
}

/// A box, by two of its corners.
pub fn bounds(text: &str) -> Result<Bounds, String> {
    let numbers: Result<Vec<f32>, _> =
        text.split(',').map(|text| number(text, "a number", |_| true)).collect();
    match numbers.as_deref() {
        Ok(&[x0, y0, z0, x1, y1, z1]) => {
            let (a, b) = (Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1));
            Ok(Bounds { min: a.min(b), max: a.max(b) })
        }
        _ => Err("two corners, such as 0,0,0,4,2.5,6".to_owned()),
    }
}

/// A radius in scene units, or with the letter s in spacings.
pub fn radius(text: &str) -> Result<Radius, String> {
    match text.strip_suffix('s') {
        Some(spacings) => positive(spacings).map(Radius::Spacings),
        None => positive(text).map(Radius::Units),
    }
}

/// How often light passes between surfaces; 0 is never.
#[derive(Clone, Copy, Debug)]
pub struct Bounces(pub u32);

/// Times that light passes between surfaces: 1 to 1000, or off.
pub fn bounces(text: &str) -> Result<Bounces, String> {
    match text.parse() {
        Ok(bounces @ 1..=1000) => Ok(Bounces(bounces)),
        _ if text == "off" => Ok(Bounces(0)),
        _ => Err("a number from 1 to 1000, or off".to_owned()),
    }
}

/// A share: a number from 0 up.
pub fn share(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(share) if share >= 0.0 && share.is_finite() => Ok(share),
        _ => Err("a number from 0 up".to_owned()),
    }
}

/// An error: a share, or per cent.
pub fn error_share(text: &str) -> Result<f32, String> {
    let wanted = "a share from 0 to 1, or per cent: 0.05, 5%";
    let within = |limit: f64| move |value: f64| (0.0..=limit).contains(&value);
    match text.trim().strip_suffix('%') {
        Some(percent) => number::<f32>(percent, wanted, within(100.0)).map(|percent| percent / 100.0),
        None => number(text, wanted, within(1.0)),
    }
}

/// A time that a render may take, if there is a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeLimit(pub Option<Duration>);

/// A time, in seconds if it has no unit; 0 is no limit.
pub fn time_limit(text: &str) -> Result<TimeLimit, String> {
    let wanted = "a time such as 30, 90s, 5m or 1h";
    let text = text.trim();
    let units = [('s', 1.0), ('m', 60.0), ('h', 3600.0)];
    let (count, unit) = units
        .into_iter()
        .find_map(|(letter, seconds)| text.strip_suffix(letter).map(|count| (count, seconds)))
        .unwrap_or((text, 1.0));
    let count: f64 = number(count, wanted, |count| count >= 0.0)?;
    let time = Duration::try_from_secs_f64(count * unit).map_err(|_| format!("`{text}` is not {wanted}"))?;
    Ok(TimeLimit((!time.is_zero()).then_some(time)))
}

/// A distance between mesh points: one for all axes, one per axis, or `auto`.
pub fn spacing(text: &str) -> Result<Spacing, String> {
    if text == Spacing::AUTO {
        return Ok(Spacing::Auto);
    }
    let numbers = text.split(',').map(positive).collect::<Result<Vec<_>, _>>()?;
    match numbers[..] {
        [all] => Ok(Spacing::Units(Vec3::splat(all))),
        [x, y, z] => Ok(Spacing::Units(Vec3::new(x, y, z))),
        _ => Err("one number or three".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A size that no image can have is refused before anything is rendered; the largest one is not.
    #[test]
    fn resolutions_end_where_images_end() {
        assert_eq!(resolution("640x480"), Ok((640, 480)));
        assert_eq!(u64::from(MAX_SIDE) * 4096, MAX_PIXELS);
        assert_eq!(resolution("65536X4096"), Ok((65536, 4096)));
        for wrong in ["65536x4097", "65537x1", "0x5", "5", "5x", "-1x5", "5x5x5", "4294967297x1"] {
            assert!(resolution(wrong).is_err(), "{wrong}");
        }
    }

    /// The range is the scene file's, both ends included.
    #[test]
    fn exposures_lie_in_their_range() {
        assert_eq!((exposure("100"), exposure("-100")), (Ok(100.0), Ok(-100.0)));
        for wrong in ["100.5", "-101", "nan", "inf", "", "bright"] {
            assert!(exposure(wrong).is_err(), "{wrong}");
        }
    }

    /// What is 0, or overflows single precision, is no length.
    #[test]
    fn lengths_are_above_0_and_finite() {
        assert_eq!(radius("2.5s"), Ok(Radius::Spacings(2.5)));
        assert_eq!(radius("2.5"), Ok(Radius::Units(2.5)));
        assert_eq!(spacing("auto"), Ok(Spacing::Auto));
        assert_eq!(spacing("1,2,3"), Ok(Spacing::Units(Vec3::new(1.0, 2.0, 3.0))));
        for wrong in ["0", "-1", "1e39", "nan", "1,2", "1,0,1"] {
            assert!(spacing(wrong).is_err(), "{wrong}");
        }
    }

    /// Per cent and shares are told apart, so that nobody asks for an error of five hundred per cent.
    #[test]
    fn errors_are_shares_or_per_cent() {
        assert_eq!((error_share("5%"), error_share("0.05"), error_share("0")), (Ok(0.05), Ok(0.05), Ok(0.0)));
        for wrong in ["5", "-1%", "101%", "nan", "%", ""] {
            assert!(error_share(wrong).is_err(), "{wrong}");
        }
    }

    /// Times have units; 0 is no limit.
    #[test]
    fn times_have_units() {
        let seconds = |count| Ok(TimeLimit(Some(Duration::from_secs_f64(count))));
        assert_eq!(
            (time_limit("30"), time_limit("1.5s"), time_limit("2m")),
            (seconds(30.0), seconds(1.5), seconds(120.0))
        );
        assert_eq!((time_limit("1h"), time_limit("0")), (seconds(3600.0), Ok(TimeLimit(None))));
        for wrong in ["-1", "1d", "1e300h", "s", "inf", ""] {
            assert!(time_limit(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn points_have_three_finite_coordinates() {
        assert_eq!(point("0, 1.5,-2"), Ok(Vec3::new(0.0, 1.5, -2.0)));
        for wrong in ["1,2", "1,2,3,4", "1,2,inf", ""] {
            assert!(point(wrong).is_err(), "{wrong}");
        }
    }
}
