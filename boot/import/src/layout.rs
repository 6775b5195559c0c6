//! Decides how a model's texture is cut from its image.
//!
//! An OBJ's texture repeats without end on all sides. A texture of the renderer is a rectangle with at most
//! 256 texels a side, so it gets only the part of that plane that the faces use. Each face is moved by whole
//! images, so that its coordinates begin in the first image. The rectangle around all moved faces is then
//! cut from the plane, and the image is scaled down until the rectangle fits. A model that uses a corner of
//! its image has that corner at full sharpness; a model that repeats the image four times has it at a
//! quarter. The image is never scaled up.

use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};

use crate::obj::BadLine;
use crate::polygon::Polygon;

/// The largest number of times that a face may repeat the texture: four texels remain for each repetition.
const MAX_REPEATS: f64 = 64.0;
/// The distance beyond a border of the texture, in textures, up to which a coordinate counts as the border.
/// Programs write 1.0001, and half a texel is not visible.
const SLACK: f64 = 1.0 / 512.0;
/// One texel in a corner's 16.16 coordinates.
const TEXEL: f64 = 65_536.0;

/// The interval that is cut from the plane of repeated images, along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CropRange {
    /// The texels of the whole image, after scaling.
    image: u32,
    /// The first texel of the cut, relative to the start of the first image.
    first: i64,
    /// The number of texels of the cut, 1 to 256.
    texels: u16,
}

impl CropRange {
    /// Returns the interval for coordinates from `low` to `high`, in whole images of `pixels` pixels.
    fn around(low: f64, high: f64, pixels: u32) -> Self {
        let mut image = pixels.min((256.0 / (high - low).max(1e-9)) as u32).max(1);
        loop {
            let first = (low * f64::from(image)).floor() as i64;
            let end = (high * f64::from(image)).ceil() as i64;
            let texels = (end - first).max(1);
            // Rounded out to whole texels, the interval can be one texel too long.
            if texels <= 256 || image == 1 {
                return Self {
                    image,
                    first,
                    texels: texels.min(256) as u16,
                };
            }
            image -= 1;
        }
    }

    /// Returns the position of a coordinate in the cut, 16.16.
    fn place(&self, coordinate: f64) -> i32 {
        let texel = coordinate * f64::from(self.image) - self.first as f64;
        (texel.clamp(0.0, self.texels.into()) * TEXEL).round() as i32
    }

    /// Returns the pixel of the scaled image for a texel of the cut.
    fn pixel(&self, texel: u32) -> u32 {
        (self.first + i64::from(texel)).rem_euclid(self.image.into()) as u32
    }
}

/// Returns the number of whole images to subtract from a polygon's coordinates, so that it begins in the
/// first image.
fn begin(polygon: &Polygon, axis: usize) -> f64 {
    let low = polygon.along(axis).fold(f64::INFINITY, f64::min);
    (low + SLACK).floor()
}

/// Returns the interval of a polygon's coordinates, in whole images, after the move.
fn range(polygon: &Polygon, axis: usize) -> (f64, f64) {
    let begin = begin(polygon, axis);
    let moved = polygon.along(axis).map(|place| place - begin);
    let (low, high) = moved.fold((f64::INFINITY, 0.0), |(low, high), place| {
        (f64::min(low, place), f64::max(high, place))
    });
    let border = high.round();
    let over = high > border && high - border <= SLACK;
    (low.max(0.0), if over { border } else { high })
}

/// The cut of a model's texture from its image.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    across: CropRange,
    down: CropRange,
}

impl Layout {
    /// Returns the cut that the polygons need from an image of `width` x `height` pixels.
    ///
    /// # Errors
    /// For the first polygon that repeats the image more than `MAX_REPEATS` times.
    pub fn new(polygons: &[Polygon], (width, height): (u32, u32)) -> Result<Self, BadLine> {
        let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for polygon in polygons {
            for (axis, (low, high)) in ranges.iter_mut().enumerate() {
                let (from, to) = range(polygon, axis);
                if to - from > MAX_REPEATS {
                    let why = format!(
                        "the face repeats the texture {:.0} times, but at most {MAX_REPEATS} \
                         repeats fit into 256 texels; cut the face or scale its texture coordinates",
                        to - from
                    );
                    return Err(BadLine {
                        line: polygon.line,
                        why,
                    });
                }
                *low = low.min(from);
                *high = high.max(to);
            }
        }
        let [(left, right), (top, bottom)] = ranges;
        Ok(Self {
            across: CropRange::around(left, right, width),
            down: CropRange::around(top, bottom, height),
        })
    }

    /// Returns the texture's width and height.
    pub fn size(&self) -> (u16, u16) {
        (self.across.texels, self.down.texels)
    }

    /// Returns the positions of a polygon's corners in the texture, 16.16 texels.
    pub fn texels(&self, polygon: &Polygon) -> impl Iterator<Item = [i32; 2]> {
        let [across, down] = [0, 1].map(|axis| begin(polygon, axis));
        let u = polygon.along(0).map(move |u| self.across.place(u - across));
        let v = polygon.along(1).map(move |v| self.down.place(v - down));
        u.zip(v).map(|(u, v)| [u, v])
    }

    /// Returns the texels, row by row. `pixel` returns the pixel in a column and a row of the image, scaled
    /// to [`Layout::scaled`].
    pub fn cut<T>(&self, pixel: impl Fn(u32, u32) -> T) -> Vec<T> {
        let (columns, rows) = self.size();
        let mut texels = Vec::with_capacity(usize::from(columns) * usize::from(rows));
        for j in 0..u32::from(rows) {
            let row =
                (0..u32::from(columns)).map(|i| pixel(self.across.pixel(i), self.down.pixel(j)));
            texels.extend(row);
        }
        texels
    }

    /// Returns the size to which the whole image is scaled, never larger than the image.
    pub fn scaled(&self) -> (u32, u32) {
        (self.across.image, self.down.image)
    }

    /// Returns the texels of an image, row by row.
    pub fn cut_scaled(&self, image: &RgbImage) -> Vec<Rgb<u8>> {
        let (width, height) = self.scaled();
        if image.dimensions() == (width, height) {
            return self.cut(|i, j| *image.get_pixel(i, j));
        }
        let image = resize(image, width, height, FilterType::CatmullRom);
        self.cut(|i, j| *image.get_pixel(i, j))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obj;
    use crate::polygon::Polygons;
    use crate::texture::MAX_PIXELS;

    /// Returns the layout of triangles with these coordinates, and the positions of their corners in texels.
    fn laid_out(triangles: &[[[f64; 2]; 3]], image: (u32, u32)) -> (Layout, Vec<[f64; 2]>) {
        let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
        for [u, v] in triangles.as_flattened() {
            text += &format!("vt {u} {v}\n");
        }
        for i in 0..triangles.len() {
            // Counter-clockwise, so that the polygons have the corners in this order.
            let [a, b, c] = [1, 2, 3].map(|k| 3 * i + k);
            text += &format!("f 3/{c} 2/{b} 1/{a}\n");
        }
        let polygons = Polygons::new(&obj::parse(text.as_bytes()).unwrap()).unwrap();
        let layout = Layout::new(&polygons.polygons, image).unwrap();
        let places = polygons
            .polygons
            .iter()
            .flat_map(|polygon| layout.texels(polygon));
        let places = places.map(|place| place.map(|k| f64::from(k) / TEXEL));
        (layout, places.collect())
    }

    const WHOLE: [[f64; 2]; 3] = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]];

    #[test]
    fn a_small_image_keeps_its_size_and_a_large_image_is_scaled_down() {
        for (image, size) in [
            ((256, 256), (256, 256)),
            ((1, 7), (1, 7)),
            ((512, 100), (256, 100)),
            ((300, 8192), (256, 256)),
        ] {
            let (layout, places) = laid_out(&[WHOLE], image);
            assert_eq!(layout.size(), size);
            assert_eq!(layout.scaled(), (size.0.into(), size.1.into()));
            let (w, h) = (f64::from(size.0), f64::from(size.1));
            assert_eq!(places, [[0.0, 0.0], [w, 0.0], [0.0, h]]);
        }
    }

    #[test]
    fn only_the_used_part_of_the_image_is_cut_at_full_resolution() {
        let corner = [[0.5, 0.25], [0.75, 0.25], [0.5, 0.0]];
        let (layout, places) = laid_out(&[corner], (512, 512));
        assert_eq!((layout.size(), layout.scaled()), ((128, 128), (512, 512)));
        assert_eq!(places, [[0.0, 0.0], [128.0, 0.0], [0.0, 128.0]]);
        let pixels = layout.cut(|i, j| (i, j));
        assert_eq!((pixels[0], pixels[128 * 128 - 1]), ((256, 384), (383, 511)));
    }

    #[test]
    fn a_repeated_image_is_cut_repeated_and_each_face_begins_in_the_first_image() {
        let wide = [[-3.0, 8.0], [-1.0, 8.0], [-3.0, 7.0]];
        let (layout, places) = laid_out(&[wide, WHOLE], (256, 256));
        assert_eq!((layout.size(), layout.scaled()), ((256, 256), (128, 256)));
        assert_eq!(places[..3], [[0.0, 0.0], [256.0, 0.0], [0.0, 256.0]]);
        assert_eq!(places[3..], [[0.0, 0.0], [128.0, 0.0], [0.0, 256.0]]);
        let row = layout.cut(|i, _| i);
        assert_eq!((row[127], row[128], row[255]), (127, 0, 127));
    }

    #[test]
    fn a_coordinate_just_beyond_the_border_is_clamped_to_it() {
        let hair = [[-0.0005, 1.0004], [1.0006, 1.0], [0.0, -0.001]];
        let (layout, places) = laid_out(&[hair], (256, 256));
        assert_eq!(layout.size(), (256, 256));
        assert_eq!(places[1][0], 256.0);
        assert_eq!(places[0], [0.0, 0.0]);
    }

    #[test]
    fn every_crop_range_fits_for_any_coordinates() {
        let mut random = seeded::generator();
        for case in 0..20_000 {
            let low = random.f64();
            let high = low + random.f64().powi(8) * MAX_REPEATS;
            let pixels = random.u32(1..=MAX_PIXELS);
            let range = CropRange::around(low, high, pixels);
            assert!(
                range.image <= pixels && (1..=256).contains(&range.texels),
                "{case}"
            );
            for (place, border) in [(low, 0.0), (high, f64::from(range.texels))] {
                let texel = place * f64::from(range.image) - range.first as f64;
                assert!((texel - border).abs() <= 1.0, "{case}: {range:?}");
            }
            assert!(range.pixel(u32::from(range.texels) - 1) < range.image);
        }
    }
}
