//! Rays as text, exact to the bit.

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

/// The ray's eight numbers with commas between, each as the shortest decimal that stands for no other `f32`.
pub fn to_text(ray: &Ray) -> String {
    let (o, d) = (ray.origin, ray.direction);
    [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_near, ray.t_far].map(|number| format!("{number:?}")).join(",")
}

/// The ray of a text of eight numbers with commas between: origin, direction, t_near, t_far.
///
/// # Errors
/// [`RayTextError`] for a text that isn't eight numbers.
pub fn from_text(text: &str) -> Result<Ray, RayTextError> {
    let number = |text: &str| text.trim().parse().map_err(|_| RayTextError::Number(text.trim().to_owned()));
    let numbers = text.split(',').map(number).collect::<Result<Vec<f32>, _>>()?;
    let &[ox, oy, oz, dx, dy, dz, t_near, t_far] = &numbers[..] else {
        return Err(RayTextError::Count(numbers.len()));
    };
    Ok(Ray { origin: Vec3::new(ox, oy, oz), direction: Vec3::new(dx, dy, dz), t_near, t_far })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray that is printed and read again is the same ray, whatever its numbers: the rays to look into are those whose
    /// last bits decide.
    #[test]
    fn texts_keep_every_bit() {
        let next = f32::from_bits(1.0f32.to_bits() + 1);
        for value in [
            0.0,
            -0.0,
            next,
            -0.1,
            f32::MAX,
            f32::MIN_POSITIVE,
            f32::from_bits(1),
            -3e-40,
            f32::INFINITY,
            f32::NEG_INFINITY,
            std::f32::consts::PI,
        ] {
            let text = to_text(&Ray { t_far: value, ..Ray::new(Vec3::ZERO, Vec3::splat(value)) });
            let ray = from_text(&text).expect("it is a ray");
            let read = [ray.direction.x, ray.direction.y, ray.direction.z, ray.t_far].map(f32::to_bits);
            assert_eq!(read, [value.to_bits(); 4], "{text}");
        }
        let text = to_text(&Ray { t_near: f32::NAN, ..Ray::new(Vec3::ZERO, Vec3::X) });
        assert!(from_text(&text).is_ok_and(|ray| ray.t_near.is_nan()), "{text}");
    }

    /// What people write is read, and what is no ray is refused.
    #[test]
    fn decimal_numbers_are_read_and_others_refused() {
        let ray = from_text("1, -2.5,3, 0,0,-1, 0,inf").expect("a ray");
        assert_eq!(ray, Ray::new(Vec3::new(1.0, -2.5, 3.0), Vec3::NEG_Z));
        assert_eq!(from_text("1,2,3"), Err(RayTextError::Count(3)));
        for wrong in ["", "x", "0x1p+0", "--1", "1e"] {
            let text = format!("{wrong},0,0,0,0,1,0,1");
            assert_eq!(from_text(&text), Err(RayTextError::Number(wrong.to_owned())));
        }
    }
}
