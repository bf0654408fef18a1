//! Rectangles of pixels: parts of an image that are rendered, written and put together by themselves.

use super::Image;

/// A rectangle of pixels of an image, from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
}

impl Window {
    /// All of an image of the given width and height.
    pub fn whole((width, height): (u32, u32)) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// From the corner (x0, y0), which belongs to it, to (x1, y1), which doesn't; `None` if it holds no pixel.
    pub fn between((x0, y0): (u32, u32), (x1, y1): (u32, u32)) -> Option<Self> {
        (x0 < x1 && y0 < y1).then(|| Self { x: x0, y: y0, width: x1 - x0, height: y1 - y0 })
    }

    /// First column and row beyond it.
    pub fn end(&self) -> (u32, u32) {
        (self.x.saturating_add(self.width), self.y.saturating_add(self.height))
    }

    /// Whether it lies in an image of the given width and height.
    pub fn is_within(&self, (width, height): (u32, u32)) -> bool {
        let (right, bottom) = self.end();
        self.width > 0 && self.height > 0 && right <= width && bottom <= height
    }

    /// Whether two windows share a pixel.
    pub fn meets(&self, other: &Self) -> bool {
        let ((right, bottom), (other_right, other_bottom)) = (self.end(), other.end());
        self.x < other_right && other.x < right && self.y < other_bottom && other.y < bottom
    }

    /// The squares of a raster that it meets, within an image of the given width and height.
    pub fn on_raster(&self, step: u32, (width, height): (u32, u32)) -> Self {
        let down = |at: u32| at / step * step;
        let (right, bottom) = self.end();
        let (right, bottom) =
            (right.next_multiple_of(step).min(width), bottom.next_multiple_of(step).min(height));
        let (x, y) = (down(self.x), down(self.y));
        Self { x, y, width: right.saturating_sub(x), height: bottom.saturating_sub(y) }
    }

    /// The `number`-th (from 1) of `count` parts that an image of the given width and height is cut into, along a raster of squares of `step`
    /// pixels: columns and rows of parts as nearly square as such a number of parts can be. `None` if there is no such part, or the raster has too
    /// few squares.
    pub fn part((width, height): (u32, u32), step: u32, number: u32, count: u32) -> Option<Self> {
        let squares = (width.div_ceil(step), height.div_ceil(step));
        if number == 0 || number > count {
            return None;
        }
        let ways = (1..=count.min(squares.0)).filter(|columns| count.is_multiple_of(*columns));
        let fitting = ways.map(|columns| (columns, count / columns)).filter(|(_, rows)| *rows <= squares.1);
        let elongation = |&(columns, rows): &(u32, u32)| {
            let (wide, high) = (u64::from(width) * u64::from(rows), u64::from(height) * u64::from(columns));
            // Sides of a part over each other, in thousandths: whole numbers have an order.
            wide.max(high) * 1000 / wide.min(high).max(1)
        };
        let (columns, rows) = fitting.min_by_key(elongation)?;
        let (column, row) = ((number - 1) % columns, (number - 1) / columns);
        let edge = |index: u32, parts: u32, squares: u32, length: u32| {
            let square = u64::from(index) * u64::from(squares) / u64::from(parts);
            (square * u64::from(step)).min(u64::from(length)) as u32
        };
        Self::between(
            (edge(column, columns, squares.0, width), edge(row, rows, squares.1, height)),
            (edge(column + 1, columns, squares.0, width), edge(row + 1, rows, squares.1, height)),
        )
    }
}

impl Image {
    /// The pixels of a window as an image of their own; `None` if it does not lie within the image.
    pub fn crop(&self, window: Window) -> Option<Self> {
        if !window.is_within((self.width(), self.height())) {
            return None;
        }
        let columns = window.x as usize..window.end().0 as usize;
        let rows = self.rows().skip(window.y as usize).take(window.height as usize);
        let pixels = rows.flat_map(|row| row.get(columns.clone()).unwrap_or_default()).copied().collect();
        Self::from_pixels(window.width, window.height, pixels).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts of an image have all its pixels, each once, whatever their number; their borders lie on the raster.
    #[test]
    fn parts_cover_an_image_once() {
        for resolution in [(800, 600), (33, 65), (1920, 1080), (64, 2000)] {
            for count in [1, 2, 3, 4, 6, 7, 8] {
                let parts: Option<Vec<Window>> =
                    (1..=count).map(|number| Window::part(resolution, 32, number, count)).collect();
                let Some(parts) = parts else {
                    // A prime number of parts needs as many squares in a row.
                    assert!(resolution == (33, 65), "{count} parts of {resolution:?}");
                    continue;
                };
                let area: u32 = parts.iter().map(|part| part.width * part.height).sum();
                assert_eq!(area, resolution.0 * resolution.1);
                for (index, part) in parts.iter().enumerate() {
                    assert!(part.is_within(resolution) && part.x % 32 == 0 && part.y % 32 == 0);
                    assert!(!parts[index + 1..].iter().any(|other| other.meets(part)));
                }
            }
            assert_eq!(Window::part(resolution, 32, 0, 4), None);
            assert_eq!(Window::part(resolution, 32, 5, 4), None);
        }
        // Eight parts of a wide image are four columns of two.
        assert_eq!(Window::part((1600, 900), 32, 1, 8), Window::between((0, 0), (384, 448)));
    }

    /// A crop holds the pixels of its window; windows beyond the image hold none.
    #[test]
    fn crops_are_parts() {
        let pixels = (0..12).map(|i| [i as f32; 3]).collect();
        let image = Image::from_pixels(4, 3, pixels).unwrap();
        let window = Window { x: 1, y: 1, width: 2, height: 2 };
        let crop = image.crop(window).unwrap();
        assert_eq!(crop.pixels(), [[5.0; 3], [6.0; 3], [9.0; 3], [10.0; 3]]);
        assert_eq!(window.on_raster(2, (4, 3)), Window { x: 0, y: 0, width: 4, height: 3 });
        assert!(image.crop(Window { x: 3, ..window }).is_none());
        assert!(image.crop(Window { width: 0, ..window }).is_none());
        assert!(image.crop(Window { x: u32::MAX, ..window }).is_none());
    }
}
