//! Rays as text, exact to the bit.

use std::fmt::Write;

use glam::Vec3;

use crate::scene::Ray;

/// What is wrong with a ray's text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RayTextError {
    /// Not eight numbers.
    #[error("a ray has 8 numbers (origin, direction, t_near, t_far) with commas between, not {0}")]
    Count(usize),
    /// One of them is none.
    #[error("`{0}` is not a number")]
    Number(String),
}

/// The ray's eight numbers as hexadecimal floating point (C99), with commas between.
pub fn to_text(ray: &Ray) -> String {
    let numbers = numbers_of(ray).map(hexadecimal);
    numbers.join(",")
}

/// The ray of a text that [`to_text`] wrote, or a person: decimal numbers will do as well.
pub fn from_text(text: &str) -> Result<Ray, RayTextError> {
    let numbers = text.split(',').map(|number| parse(number.trim())).collect::<Result<Vec<_>, _>>()?;
    let &[ox, oy, oz, dx, dy, dz, t_near, t_far] = &numbers[..] else {
        return Err(RayTextError::Count(numbers.len()));
    };
    Ok(Ray { origin: Vec3::new(ox, oy, oz), direction: Vec3::new(dx, dy, dz), t_near, t_far })
}

fn numbers_of(ray: &Ray) -> [f32; 8] {
    let (o, d) = (ray.origin, ray.direction);
    [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_near, ray.t_far]
}

fn hexadecimal(value: f32) -> String {
    if value.is_nan() {
        return "nan".to_owned();
    }
    let sign = if value.is_sign_negative() { "-" } else { "" };
    if value.is_infinite() {
        return format!("{sign}inf");
    }
    let bits = value.to_bits();
    let (exponent, fraction) = ((bits >> 23 & 0xff) as i32, bits & 0x7f_ffff);
    let (leading, exponent) = if exponent == 0 { (0, -126) } else { (1, exponent - 127) };
    let mut text = format!("{sign}0x{leading}");
    if fraction != 0 {
        // 23 bits are five digits and three quarters.
        let digits = format!("{:06x}", fraction << 1);
        // Writing to a string can't fail.
        let _ = write!(text, ".{}", digits.trim_end_matches('0'));
    }
    let exponent = if value == 0.0 { 0 } else { exponent };
    text + &format!("p{exponent:+}")
}

fn parse(text: &str) -> Result<f32, RayTextError> {
    let wrong = || RayTextError::Number(text.to_owned());
    let (negative, digits) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let value = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(digits) => parse_hexadecimal(digits).ok_or_else(wrong)?,
        None if digits.starts_with(['+', '-']) => return Err(wrong()),
        None => digits.parse().map_err(|_| wrong())?,
    };
    Ok(if negative { -value } else { value })
}

fn parse_hexadecimal(text: &str) -> Option<f32> {
    let (mantissa, exponent) = text.split_once(['p', 'P'])?;
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{whole}{fraction}");
    if digits.is_empty() || digits.len() > 12 || digits.starts_with('+') {
        return None;
    }
    let mantissa = u64::from_str_radix(&digits, 16).ok()?;
    let exponent: i32 = exponent.parse().ok().filter(|e: &i32| e.abs() <= 1000)?;
    // Up to 48 bits and all exponents of a float are exact in double precision.
    Some((mantissa as f64 * 2f64.powi(exponent - 4 * fraction.len() as i32)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray that is printed and read again is the same ray, whatever its numbers.
    #[test]
    fn texts_keep_every_bit() {
        for value in [
            0.0,
            -0.0,
            1.0,
            -0.1,
            f32::MAX,
            f32::MIN_POSITIVE,
            1e-45,
            -3e-40,
            f32::INFINITY,
            f32::NEG_INFINITY,
            std::f32::consts::PI,
        ] {
            let text = hexadecimal(value);
            assert_eq!(parse(&text).map(f32::to_bits), Ok(value.to_bits()), "{text}");
        }
        assert!(parse("nan").is_ok_and(f32::is_nan));
        assert_eq!(hexadecimal(1.5), "0x1.8p+0");
        assert_eq!(hexadecimal(-0.15625), "-0x1.4p-3");
    }

    /// What people write is read, and what is no ray is refused.
    #[test]
    fn decimal_numbers_are_read_and_others_refused() {
        let ray = from_text("1, -2.5,3, 0,0,-1, 0,inf").expect("a ray");
        assert_eq!(ray, Ray::new(Vec3::new(1.0, -2.5, 3.0), Vec3::NEG_Z));
        assert_eq!(from_text("1,2,3"), Err(RayTextError::Count(3)));
        for wrong in ["", "x", "0x", "0x1", "0xp+1", "--1", "0x1.8pp", "0x1.8p99999"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
