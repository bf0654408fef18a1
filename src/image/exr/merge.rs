//! Putting parts of a picture together.

use std::collections::BTreeMap;

use super::{Channel, ChannelImage, DataWindow, Samples};

/// Why parts are no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MergeError {
    /// A part is of another picture than the first one.
    #[error("part {part} differs from the first one in {what}")]
    Different {
        /// Number of the part, from 0.
        part: usize,
        /// In what.
        what: String,
    },
    /// Two parts disagree about a pixel that both have.
    #[error("part {part} has another value at column {x}, row {y} than a part before it")]
    Disagree {
        /// Number of the part, from 0.
        part: usize,
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// Pixels are missing.
    #[error("{count} pixels are missing, the first at column {x}, row {y}")]
    Missing {
        /// How many.
        count: usize,
        /// Column of the first.
        x: u32,
        /// Row of the first.
        y: u32,
    },
    /// There are no parts.
    #[error("there is no part")]
    Empty,
}

/// Puts parts of one picture together, bit for bit. Pixels that several parts have must be the same in all; attributes that are not the same in all
/// parts, other than those in `identity`, are left out.
///
/// # Errors
/// See [`MergeError`].
pub fn merge(parts: &[ChannelImage], identity: &[&str]) -> Result<ChannelImage, MergeError> {
    let first = parts.first().ok_or(MergeError::Empty)?;
    for (part, other) in parts.iter().enumerate().skip(1) {
        check_same(first, other, identity).map_err(|what| MergeError::Different { part, what })?;
    }
    let (width, height) = first.display;
    let mut whole = ChannelImage::new(first.display, DataWindow::of_display(first.display));
    let in_all = |entry: &(String, String)| parts.iter().all(|part| part.metadata.contains(entry));
    for entry in &first.metadata {
        if in_all(entry) {
            whole.metadata.push(entry.clone());
        } else if is_manifest(&entry.0)
            && let Some(manifest) = merged_manifest(parts, &entry.0)
        {
            whole.metadata.push((entry.0.clone(), manifest));
        }
    }
    let pixels = whole.window.pixels() as usize;
    whole.channels = first
        .channels
        .iter()
        .map(|channel| Channel {
            name: channel.name.clone(),
            samples: match channel.samples {
                Samples::Half(_) => Samples::Half(vec![Default::default(); pixels]),
                Samples::Float(_) => Samples::Float(vec![0.0; pixels]),
                Samples::Whole(_) => Samples::Whole(vec![0; pixels]),
            },
        })
        .collect();
    let mut there = vec![false; pixels];
    for (part, image) in parts.iter().enumerate() {
        let places = places(image, (width, height));
        for (whole, channel) in whole.channels.iter_mut().zip(&image.channels) {
            let differs = match (&mut whole.samples, &channel.samples) {
                (Samples::Half(whole), Samples::Half(part)) => {
                    put(whole, part, &places, &there, |v| v.to_bits())
                }
                (Samples::Float(whole), Samples::Float(part)) => {
                    put(whole, part, &places, &there, f32::to_bits)
                }
                (Samples::Whole(whole), Samples::Whole(part)) => put(whole, part, &places, &there, |v| v),
                // The types are the same.
                _ => None,
            };
            if let Some(place) = differs {
                let (x, y) = (place as u32 % width, place as u32 / width);
                return Err(MergeError::Disagree { part, x, y });
            }
        }
        for place in places.into_iter().flatten() {
            there.get_mut(place).into_iter().for_each(|there| *there = true);
        }
    }
    match there.iter().position(|there| !there) {
        None => Ok(whole),
        Some(place) => Err(MergeError::Missing {
            count: there.iter().filter(|there| !**there).count(),
            x: place as u32 % width,
            y: place as u32 / width,
        }),
    }
}

/// Whether an attribute lists the names of Cryptomatte's ids: each part lists those that it shows.
fn is_manifest(key: &str) -> bool {
    key.starts_with("cryptomatte/") && key.ends_with("/manifest")
}

/// The names of all parts; `None` if one has no list.
fn merged_manifest(parts: &[ChannelImage], key: &str) -> Option<String> {
    let mut names = BTreeMap::<String, String>::new();
    for part in parts {
        let (_, manifest) = part.metadata.iter().find(|(name, _)| name == key)?;
        names.extend(serde_json::from_str::<BTreeMap<String, String>>(manifest).ok()?);
    }
    serde_json::to_string(&names).ok()
}

/// In what two parts are not of one picture.
fn check_same(first: &ChannelImage, other: &ChannelImage, identity: &[&str]) -> Result<(), String> {
    if first.display != other.display {
        return Err("the size of the whole picture".to_owned());
    }
    let kinds = |image: &ChannelImage| {
        let kind = |channel: &Channel| (channel.name.clone(), std::mem::discriminant(&channel.samples));
        image.channels.iter().map(kind).collect::<Vec<_>>()
    };
    if kinds(first) != kinds(other) {
        return Err("its channels".to_owned());
    }
    for key in identity {
        let value = |image: &ChannelImage| image.metadata.iter().find(|(name, _)| name == key).cloned();
        if value(first) != value(other) {
            return Err(format!("the attribute `{key}`"));
        }
    }
    Ok(())
}

/// Where each sample of a part lies in the whole; `None` for those that lie beyond it.
fn places(part: &ChannelImage, (width, height): (u32, u32)) -> Vec<Option<usize>> {
    let DataWindow { x, y, width: columns, height: rows } = part.window;
    let within = |start: i32, offset: u32, end: u32| {
        u32::try_from(i64::from(start) + i64::from(offset)).ok().filter(|at| *at < end)
    };
    let place = |row: u32, column: u32| {
        let (x, y) = (within(x, column, width)?, within(y, row, height)?);
        Some(y as usize * width as usize + x as usize)
    };
    (0..rows).flat_map(|row| (0..columns).map(move |column| place(row, column))).collect()
}

/// Puts samples of a part into the whole. Returns the first place that was there already with another value.
fn put<T: Copy, B: PartialEq>(
    whole: &mut [T],
    part: &[T],
    places: &[Option<usize>],
    there: &[bool],
    bits: impl Fn(T) -> B,
) -> Option<usize> {
    for (&value, place) in part.iter().zip(places) {
        let Some(place) = *place else { continue };
        let (Some(own), Some(there)) = (whole.get_mut(place), there.get(place)) else { continue };
        if *there && bits(*own) != bits(value) {
            return Some(place);
        }
        *own = value;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(x: i32, width: u32, value: f32) -> ChannelImage {
        let mut image = ChannelImage::new((4, 1), DataWindow { x, y: 0, width, height: 1 });
        let values: Vec<f32> = (0..width).map(|i| value + (x + i as i32) as f32).collect();
        image.channels.push(Channel::new("Z", Samples::Float(values)));
        image.metadata = vec![("scene".into(), "a".into()), ("rays".into(), x.to_string())];
        image
    }

    /// Parts that are there, once or several times the same, make the picture; attributes that belong to a part alone are gone.
    #[test]
    fn parts_make_a_picture() {
        let whole = merge(&[part(2, 2, 0.0), part(0, 3, 0.0)], &["scene"]).unwrap();
        assert_eq!(whole.channels, [Channel::new("Z", Samples::Float(vec![0.0, 1.0, 2.0, 3.0]))]);
        assert_eq!(whole.metadata, [("scene".to_owned(), "a".to_owned())]);
        assert_eq!(whole.window, DataWindow::of_display((4, 1)));
    }

    /// Each part of a Cryptomatte layer names what it shows; the whole names all.
    #[test]
    fn names_of_ids_are_put_together() {
        let with = |mut image: ChannelImage, manifest: &str| {
            image.metadata.push(("cryptomatte/0123abc/manifest".into(), manifest.into()));
            image
        };
        let left = with(part(0, 2, 0.0), r#"{"floor":"11"}"#);
        let right = with(part(2, 2, 0.0), r#"{"wall":"22","floor":"11"}"#);
        let whole = merge(&[left, right], &[]).unwrap();
        let manifest = whole.metadata.iter().find(|(key, _)| key.ends_with("manifest")).unwrap();
        assert_eq!(manifest.1, r#"{"floor":"11","wall":"22"}"#);
    }

    /// What does not belong together is not put together.
    #[test]
    fn other_parts_are_refused() {
        assert_eq!(merge(&[], &[]), Err(MergeError::Empty));
        assert_eq!(
            merge(&[part(0, 2, 0.0), part(3, 1, 0.0)], &[]),
            Err(MergeError::Missing { count: 1, x: 2, y: 0 })
        );
        assert_eq!(
            merge(&[part(0, 2, 0.0), part(1, 3, 0.5)], &[]),
            Err(MergeError::Disagree { part: 1, x: 1, y: 0 })
        );
        let different = |change: &dyn Fn(&mut ChannelImage)| {
            let mut other = part(2, 2, 0.0);
            change(&mut other);
            match merge(&[part(0, 2, 0.0), other], &["scene"]) {
                Err(MergeError::Different { part: 1, what }) => what,
                found => panic!("{found:?}"),
            }
        };
        assert!(different(&|image| image.display = (5, 1)).contains("size"));
        assert!(different(&|image| image.channels[0].name = "Y".into()).contains("channels"));
        assert!(different(&|image| image.metadata[0].1 = "b".into()).contains("scene"));
    }
}
