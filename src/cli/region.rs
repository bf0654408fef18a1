//! Which part of an image is rendered.

use std::str::FromStr;

use clap::Args;

use super::error::CommandError;
use crate::image::Window;
use crate::render::TILE;

/// Part of the image to render.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct RegionArgs {
    /// Render the part from column X0 and row Y0 up to, but without, X1 and Y1, counted from the upper left corner
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = corners)]
    crop: Option<Window>,
    /// Render the I-th of N parts of about the same size, counted from 1; `lightmesh merge` puts them together
    #[arg(long, value_name = "I/N", conflicts_with = "crop")]
    tile: Option<Part>,
}

/// One of several parts.
#[derive(Clone, Copy, Debug)]
struct Part {
    number: u32,
    count: u32,
}

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { number, count }),
            _ => Err("a part and the number of parts, such as 2/8, the first being 1/8".to_owned()),
        }
    }
}

fn corners(text: &str) -> Result<Window, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let window = match numbers.as_deref() {
        Ok(&[x0, y0, x1, y1]) => Window::between((x0, y0), (x1, y1)),
        _ => None,
    };
    window.ok_or_else(|| "two corners, such as 0,0,320,240, that have pixels between them".to_owned())
}

impl RegionArgs {
    /// The part of an image of the given width and height; `None` for all of it.
    ///
    /// # Errors
    /// [`CommandError::Region`].
    pub fn window(self, resolution: (u32, u32)) -> Result<Option<Window>, CommandError> {
        let (width, height) = resolution;
        let refuse = |problem: String| CommandError::Region { width, height, problem };
        if let Some(window) = self.crop {
            let (x1, y1) = window.end();
            let inside = window.is_within(resolution);
            return if inside {
                Ok(Some(window))
            } else {
                Err(refuse(format!("--crop reaches to column {x1} and row {y1}")))
            };
        }
        let Some(Part { number, count }) = self.tile else { return Ok(None) };
        let window = Window::part(resolution, TILE, number, count);
        window.map(Some).ok_or_else(|| {
            refuse(format!("--tile can't cut it into {count} rectangles along a raster of {TILE} pixels"))
        })
    }
}
