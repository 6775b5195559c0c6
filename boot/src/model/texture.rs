//! From a PNG to the texels of a model.
//!
//! An OBJ's texture has no end: it repeats to all sides. A texture here is a rectangle of at most
//! 256 texels a side, so it gets what the faces use of that plane and no more. Each face is moved by
//! whole textures to where its coordinates begin in the first one. The rectangle around all of them
//! is then cut from the plane, and the picture is scaled down until it fits. A model that uses a
//! corner of its picture has that corner in full sharpness; one that repeats it four times has a
//! quarter of it. It is never scaled up.

use std::io::{BufRead, Seek};

use anyhow::{Context, anyhow, bail, ensure};
use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};
use png::{BitDepth, ColorType, Decoder, Transformations};

use super::kind;
use super::mesh::Polygon;
use super::obj::BadLine;
use system::quote::quoted;

/// How every PNG begins.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Longest side of a PNG that is read, in pixels: its pixels take up to a quarter of a GiB.
pub const MAX_PIXELS: u32 = 8192;
/// The colour beneath a picture's transparent parts. Black writing and white writing without a
/// ground both stay readable on grey.
pub const GROUND: [u8; 3] = [128; 3];
/// Most times that a face may repeat the texture: then four texels are left of it.
const MAX_REPEATS: f64 = 64.0;
/// So far a coordinate may be beyond a border of the texture, in textures, and is taken to mean the
/// border: programs write 1.0001, and half a texel is not seen.
const SLACK: f64 = 1.0 / 512.0;
/// One texel of a corner's place.
const TEXEL: f64 = 65_536.0;

/// A picture, opaque.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Its pixels, laid over [`GROUND`] where they are transparent.
    pub pixels: RgbImage,
    /// Some of it was transparent.
    pub transparent: bool,
}

/// Reads a PNG of any kind: of an animated one the picture that programs show which know of no
/// animation.
///
/// Each pixel is laid over [`GROUND`], as far as it is transparent, before anything else is done to
/// it. So colours that hide under full transparency reach neither the scaled texture nor its palette.
///
/// # Errors
/// Another format, by name; a damaged PNG; one that is larger than [`MAX_PIXELS`].
pub fn read(mut from: impl BufRead + Seek) -> anyhow::Result<Picture> {
    let begin = from.fill_buf().context("it cannot be read")?;
    if !begin.starts_with(PNG) {
        match kind::name(begin, None) {
            Some(kind) => bail!("its content is {kind}, not PNG; convert it to PNG"),
            None if begin.is_empty() => bail!("it is empty; give a PNG"),
            None => bail!("it begins with {}, not as a PNG; give a PNG", quoted(begin)),
        }
    }
    let damaged = |error| match error {
        // This limit is on what the file says beside its pixels.
        png::DecodingError::LimitsExceeded => {
            anyhow!("its header or its notes ask for too much memory; save it again, without notes")
        }
        error => anyhow!("it is not a whole PNG: {error}; save it again"),
    };
    let mut decoder = Decoder::new(from);
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // The size first: decoding takes the memory that the header asks for.
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (header.width, header.height);
    ensure!(
        width <= MAX_PIXELS && height <= MAX_PIXELS,
        "it has {width} x {height} pixels, and a texture has at most {MAX_PIXELS} a side; scale it \
         down"
    );
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    // The decoder refuses more than 768 bytes, and panics where a colour is cut (png 0.18.1,
    // `create_rgba_palette`).
    let bytes = info.palette.as_deref().unwrap_or_default().len();
    ensure!(
        bytes.is_multiple_of(3),
        "its palette has {bytes} bytes, not three for each colour; save it again"
    );
    let size = reader.output_buffer_size().context("it is too large")?;
    let mut bytes = vec![0; size];
    let frame = reader.next_frame(&mut bytes).map_err(damaged)?;
    ensure!(
        frame.bit_depth == BitDepth::Eight && (frame.width, frame.height) == (width, height),
        "its first picture is not of its header's size; save it again"
    );
    Ok(over_ground(bytes, frame.color_type, (width, height)))
}

/// Lays a decoder's pixels, 8 bits a part, over [`GROUND`].
fn over_ground(mut bytes: Vec<u8>, colour: ColorType, (width, height): (u32, u32)) -> Picture {
    let pixels = width as usize * height as usize;
    let samples = colour.samples();
    let mut transparent = false;
    let mut pixel = |from: &[u8]| {
        let (rgb, alpha) = match *from {
            [grey] => ([grey; 3], 255),
            [grey, alpha] => ([grey; 3], alpha),
            [r, g, b] => ([r, g, b], 255),
            [r, g, b, alpha] => ([r, g, b], alpha),
            _ => unreachable!("a pixel has one to four parts"),
        };
        transparent |= alpha < 255;
        let alpha = u32::from(alpha);
        let blend = |over: u8, ground: u8| {
            let sum = u32::from(over) * alpha + u32::from(ground) * (255 - alpha);
            ((sum + 127) / 255) as u8
        };
        [0, 1, 2].map(|k| blend(rgb[k], GROUND[k]))
    };
    if samples < 3 {
        let rgb = bytes.chunks_exact(samples).flat_map(&mut pixel).collect();
        bytes = rgb;
    } else {
        // In place: of the largest picture a copy is a fifth of a GiB.
        for i in 0..pixels {
            let rgb = pixel(&bytes[i * samples..][..samples]);
            bytes[3 * i..][..3].copy_from_slice(&rgb);
        }
    }
    bytes.truncate(3 * pixels);
    let pixels = RgbImage::from_raw(width, height, bytes);
    Picture {
        pixels: pixels.expect("three bytes a pixel"),
        transparent,
    }
}

/// What is cut from the plane of repeated pictures, along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Window {
    /// Texels of the whole picture.
    picture: u32,
    /// The first texel that is cut, from the first picture's begin.
    first: i64,
    /// How many are cut, 1 to 256.
    texels: u16,
}

impl Window {
    /// For coordinates from `low` to `high`, in whole pictures of `pixels`.
    fn around(low: f64, high: f64, pixels: u32) -> Self {
        let mut picture = pixels.min((256.0 / (high - low).max(1e-9)) as u32).max(1);
        loop {
            let first = (low * f64::from(picture)).floor() as i64;
            let end = (high * f64::from(picture)).ceil() as i64;
            let texels = (end - first).max(1);
            // The borders of texels lie about the window's: it may be one too many.
            if texels <= 256 || picture == 1 {
                return Self {
                    picture,
                    first,
                    texels: texels.min(256) as u16,
                };
            }
            picture -= 1;
        }
    }

    /// The place of a coordinate, 16.16.
    fn place(&self, coordinate: f64) -> i32 {
        let texel = coordinate * f64::from(self.picture) - self.first as f64;
        (texel.clamp(0.0, self.texels.into()) * TEXEL).round() as i32
    }

    /// The picture's pixel of a texel.
    fn pixel(&self, texel: u32) -> u32 {
        (self.first + i64::from(texel)).rem_euclid(self.picture.into()) as u32
    }
}

/// The whole pictures that a polygon is moved by, so that it begins in the first one.
fn begin(polygon: &Polygon, axis: usize) -> f64 {
    let low = polygon.along(axis).fold(f64::INFINITY, f64::min);
    (low + SLACK).floor()
}

/// From where to where a polygon is in the pictures, once it was moved.
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

/// How a model's texture is cut from its picture.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    across: Window,
    down: Window,
}

impl Layout {
    /// What the polygons use of a picture of `size` pixels.
    ///
    /// # Errors
    /// The first polygon that repeats the picture more often than `MAX_REPEATS` times.
    pub fn new(polygons: &[Polygon], (width, height): (u32, u32)) -> Result<Self, BadLine> {
        let mut ranges = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for polygon in polygons {
            for (axis, (low, high)) in ranges.iter_mut().enumerate() {
                let (from, to) = range(polygon, axis);
                if to - from > MAX_REPEATS {
                    let why = format!(
                        "the face repeats the texture {:.0} times, and at most {MAX_REPEATS} fit \
                         into 256 texels; cut the face or scale its texture coordinates",
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
            across: Window::around(left, right, width),
            down: Window::around(top, bottom, height),
        })
    }

    /// The texture's sides.
    pub fn size(&self) -> (u16, u16) {
        (self.across.texels, self.down.texels)
    }

    /// Where a polygon's corners are in the texture, 16.16 texels.
    pub fn texels(&self, polygon: &Polygon) -> impl Iterator<Item = [i32; 2]> {
        let [across, down] = [0, 1].map(|axis| begin(polygon, axis));
        let u = polygon.along(0).map(move |u| self.across.place(u - across));
        let v = polygon.along(1).map(move |v| self.down.place(v - down));
        u.zip(v).map(|(u, v)| [u, v])
    }

    /// The texels, row by row. `pixel` has the picture's pixel in a column and a row, when it is
    /// scaled to [`Layout::scaled`].
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

    /// The size that the whole picture is scaled to; never larger than it is.
    pub fn scaled(&self) -> (u32, u32) {
        (self.across.picture, self.down.picture)
    }

    /// The texels of a picture, row by row.
    pub fn cut_scaled(&self, picture: &RgbImage) -> Vec<Rgb<u8>> {
        let (width, height) = self.scaled();
        if picture.dimensions() == (width, height) {
            return self.cut(|i, j| *picture.get_pixel(i, j));
        }
        let picture = resize(picture, width, height, FilterType::CatmullRom);
        self.cut(|i, j| *picture.get_pixel(i, j))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::model::mesh::Polygons;
    use crate::model::obj;

    /// The layout of triangles with these coordinates, and where their corners are in texels.
    fn laid_out(triangles: &[[[f64; 2]; 3]], picture: (u32, u32)) -> (Layout, Vec<[f64; 2]>) {
        let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
        for [u, v] in triangles.as_flattened() {
            text += &format!("vt {u} {v}\n");
        }
        for i in 0..triangles.len() {
            // Against the clock, so that they come back in their order.
            let [a, b, c] = [1, 2, 3].map(|k| 3 * i + k);
            text += &format!("f 3/{c} 2/{b} 1/{a}\n");
        }
        let polygons = Polygons::new(&obj::parse(text.as_bytes()).unwrap()).unwrap();
        let layout = Layout::new(&polygons.polygons, picture).unwrap();
        let places = polygons
            .polygons
            .iter()
            .flat_map(|polygon| layout.texels(polygon));
        let places = places.map(|place| place.map(|k| f64::from(k) / TEXEL));
        (layout, places.collect())
    }

    const WHOLE: [[f64; 2]; 3] = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]];

    /// A PNG of rows of bytes.
    fn encoded(
        (width, height): (u32, u32),
        colour: ColorType,
        depth: BitDepth,
        rows: &[u8],
        more: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        more(&mut encoder);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(rows).unwrap();
        writer.finish().unwrap();
        bytes
    }

    fn picture(bytes: &[u8]) -> (Vec<u8>, bool) {
        let picture = read(Cursor::new(bytes)).unwrap();
        (picture.pixels.into_raw(), picture.transparent)
    }

    #[test]
    fn every_kind_of_png_is_read_right() {
        let palette: &[u8] = &[10, 20, 30, 40, 50, 60, 70, 80, 90];
        let grey = |values: &[u8]| values.iter().flat_map(|&v| [v; 3]).collect::<Vec<_>>();
        use BitDepth::{Eight, Four, One, Sixteen, Two};
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let whole: &[(ColorType, BitDepth, &[u8], Vec<u8>)] = &[
            (Grayscale, One, &[0b1010_0000], grey(&[255, 0, 255])),
            (Grayscale, Two, &[0b0001_1100], grey(&[0, 85, 255])),
            (Grayscale, Four, &[0x0f, 0x80], grey(&[0, 255, 136])),
            (Grayscale, Eight, &[1, 2, 3], grey(&[1, 2, 3])),
            (
                Grayscale,
                Sixteen,
                &[1, 1, 2, 2, 255, 255],
                grey(&[1, 2, 255]),
            ),
            (Rgb, Eight, &[1, 2, 3, 4, 5, 6, 7, 8, 9], (1..10).collect()),
            (
                Rgb,
                Sixteen,
                &[1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9],
                (1..10).collect(),
            ),
            (
                Indexed,
                One,
                &[0b0100_0000],
                [&palette[..6], &palette[..3]].concat(),
            ),
            (Indexed, Two, &[0b0001_1000], palette.into()),
            (Indexed, Four, &[0x01, 0x20], palette.into()),
            (Indexed, Eight, &[0, 1, 2], palette.into()),
            (
                GrayscaleAlpha,
                Eight,
                &[1, 255, 2, 255, 3, 255],
                grey(&[1, 2, 3]),
            ),
            (
                Rgba,
                Eight,
                &[1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255],
                (1..10).collect(),
            ),
        ];
        for (colour, depth, rows, pixels) in whole {
            let bytes = encoded((3, 1), *colour, *depth, rows, |encoder| {
                if *colour == Indexed {
                    encoder.set_palette(palette);
                }
            });
            assert_eq!(
                picture(&bytes),
                (pixels.clone(), false),
                "{colour:?} {depth:?}"
            );
        }
        // In seven passes: see `at`.
        let interlaced: Vec<u8> = INTERLACED
            .as_bytes()
            .chunks(2)
            .map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap())
            .collect();
        let at = |x: u8, y: u8| [x * 32, y * 32, (x ^ y) * 16];
        let all = (0..8).flat_map(|y| (0..8).map(move |x| at(x, y)));
        let all: Vec<_> = all.flatten().collect();
        assert_eq!(picture(&interlaced), (all, false));
        // Animated: the first picture.
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(Rgb);
        encoder.set_animated(2, 0).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[1, 2, 3]).unwrap();
        writer.write_image_data(&[7, 8, 9]).unwrap();
        writer.finish().unwrap();
        assert_eq!(picture(&bytes), (vec![1, 2, 3], false));
    }

    #[test]
    fn what_is_transparent_is_grey_and_what_hides_there_is_gone() {
        use BitDepth::{Eight, Sixteen, Two};
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let [ground, ..] = GROUND;
        // Half of 255 and half of the ground.
        let half = ((255 * 128 + u32::from(ground) * 127 + 127) / 255) as u8;
        let clear: &[u8] = &[ground; 3];
        type Case<'a> = (ColorType, BitDepth, &'a [u8], &'a [u8], Vec<u8>);
        let cases: &[Case] = &[
            (
                Rgba,
                Eight,
                &[],
                &[255, 0, 255, 0, 255, 255, 255, 128, 1, 2, 3, 255],
                [clear, &[half; 3], &[1, 2, 3]].concat(),
            ),
            (
                Rgba,
                Sixteen,
                &[],
                &[255, 255, 0, 0, 255, 255, 0, 0, 1, 1, 2, 2, 3, 3, 255, 255],
                [clear, &[1, 2, 3]].concat(),
            ),
            (
                GrayscaleAlpha,
                Eight,
                &[],
                &[9, 0, 255, 128, 7, 255],
                [clear, &[half; 3], &[7; 3]].concat(),
            ),
            // Keys. One of 16 bits is one colour, and not all with its upper halves.
            (
                Grayscale,
                Two,
                &[0, 1],
                &[0b0110_0000],
                [clear, &[170; 3], &[0; 3]].concat(),
            ),
            (
                Rgb,
                Eight,
                &[0, 1, 0, 2, 0, 3],
                &[1, 2, 3, 1, 2, 4],
                [clear, &[1, 2, 4]].concat(),
            ),
            (
                Rgb,
                Sixteen,
                &[1, 1, 2, 2, 3, 3],
                &[1, 1, 2, 2, 3, 3, 1, 0, 2, 0, 3, 0],
                [clear, &[1, 2, 3]].concat(),
            ),
            (
                Indexed,
                Eight,
                &[0, 128],
                &[0, 1, 2],
                [clear, &[half; 3], &[7, 8, 9]].concat(),
            ),
        ];
        for (colour, depth, trns, rows, pixels) in cases {
            let size = (pixels.len() as u32 / 3, 1);
            let bytes = encoded(size, *colour, *depth, rows, |encoder| {
                if *colour == Indexed {
                    encoder.set_palette(&[255, 0, 255, 255, 255, 255, 7, 8, 9][..]);
                }
                if !trns.is_empty() {
                    encoder.set_trns(*trns);
                }
            });
            assert_eq!(
                picture(&bytes),
                (pixels.clone(), true),
                "{colour:?} {depth:?}"
            );
        }
        // The scaler and the quantizer see one colour, whatever hid there.
        let hidden: Vec<u8> = (0..300u32 * 300)
            .flat_map(|i| [i as u8, (i >> 8) as u8, 255, 0])
            .collect();
        let bytes = encoded((300, 300), Rgba, Eight, &hidden, |_| {});
        let (layout, _) = laid_out(&[WHOLE], (300, 300));
        let texels = layout.cut_scaled(&read(Cursor::new(bytes)).unwrap().pixels);
        assert!(texels.iter().all(|texel| texel.0 == GROUND));
    }

    /// 8 x 8 pixels, interlaced.
    const INTERLACED: &str = "\
         89504e470d0a1a0a0000000d49484452000000080000000808020000013c6a194a000000824944415478da0d\
         4e51150040045b0411164104112ec22288208a28a288727cb0bdcd00ae0a712daa708003214a533cca885334\
         37308a891ace008409de788b04c315d6911b0faca7ca2edbf20b4bcdebf11dbb25232fd245165f3386b91420\
         a7183209a56c69f45677b21f3ba253ad6aebc6b46fdf639b3cc33e6dd47a2f676d171fd0f74601a696b4fa00\
         00000049454e44ae426082";

    #[test]
    fn a_small_picture_stays_as_it_is_and_a_large_one_is_scaled_to_fit() {
        for (picture, size) in [
            ((256, 256), (256, 256)),
            ((1, 7), (1, 7)),
            ((512, 100), (256, 100)),
            ((300, 8192), (256, 256)),
        ] {
            let (layout, places) = laid_out(&[WHOLE], picture);
            assert_eq!(layout.size(), size);
            assert_eq!(layout.scaled(), (size.0.into(), size.1.into()));
            let (w, h) = (f64::from(size.0), f64::from(size.1));
            assert_eq!(places, [[0.0, 0.0], [w, 0.0], [0.0, h]]);
        }
    }

    #[test]
    fn only_what_is_used_is_cut_and_in_full_sharpness() {
        let corner = [[0.5, 0.25], [0.75, 0.25], [0.5, 0.0]];
        let (layout, places) = laid_out(&[corner], (512, 512));
        assert_eq!((layout.size(), layout.scaled()), ((128, 128), (512, 512)));
        assert_eq!(places, [[0.0, 0.0], [128.0, 0.0], [0.0, 128.0]]);
        let pixels = layout.cut(|i, j| (i, j));
        assert_eq!((pixels[0], pixels[128 * 128 - 1]), ((256, 384), (383, 511)));
    }

    #[test]
    fn what_repeats_is_repeated_and_each_face_is_moved_to_the_first() {
        let wide = [[-3.0, 8.0], [-1.0, 8.0], [-3.0, 7.0]];
        let (layout, places) = laid_out(&[wide, WHOLE], (256, 256));
        assert_eq!((layout.size(), layout.scaled()), ((256, 256), (128, 256)));
        assert_eq!(places[..3], [[0.0, 0.0], [256.0, 0.0], [0.0, 256.0]]);
        assert_eq!(places[3..], [[0.0, 0.0], [128.0, 0.0], [0.0, 256.0]]);
        let row = layout.cut(|i, _| i);
        assert_eq!((row[127], row[128], row[255]), (127, 0, 127));
    }

    #[test]
    fn a_hair_beyond_the_border_is_the_border() {
        let hair = [[-0.0005, 1.0004], [1.0006, 1.0], [0.0, -0.001]];
        let (layout, places) = laid_out(&[hair], (256, 256));
        assert_eq!(layout.size(), (256, 256));
        assert_eq!(places[1][0], 256.0);
        assert_eq!(places[0], [0.0, 0.0]);
    }

    #[test]
    fn every_window_fits_whatever_the_coordinates() {
        let mut random = seeded::generator();
        for case in 0..20_000 {
            let low = random.f64();
            let high = low + random.f64().powi(8) * MAX_REPEATS;
            let pixels = random.u32(1..=MAX_PIXELS);
            let window = Window::around(low, high, pixels);
            assert!(
                window.picture <= pixels && (1..=256).contains(&window.texels),
                "{case}"
            );
            for (place, border) in [(low, 0.0), (high, f64::from(window.texels))] {
                let texel = place * f64::from(window.picture) - window.first as f64;
                assert!((texel - border).abs() <= 1.0, "{case}: {window:?}");
            }
            assert!(window.pixel(u32::from(window.texels) - 1) < window.picture);
        }
    }
}
