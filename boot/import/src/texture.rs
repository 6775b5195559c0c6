//! Reads a PNG as opaque pixels.

use std::io::{BufRead, Seek};

use anyhow::{Context, anyhow, bail, ensure};
use image::RgbImage;
use png::{BitDepth, ColorType, Decoder, Transformations};

use system::quote::quoted;

use crate::file_kind;

/// The first bytes of every PNG.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
/// The longest side of a PNG that is read, in pixels. The pixels of the largest PNG need a quarter of a GiB.
pub const MAX_PIXELS: u32 = 8192;
/// The colour beneath an image's transparent parts. Black and white text without a background both stay
/// readable on grey.
pub const GROUND: [u8; 3] = [128; 3];
/// An opaque image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpaqueImage {
    /// The pixels, blended over [`GROUND`] where they are transparent.
    pub pixels: RgbImage,
    /// Whether a part of the image was transparent.
    pub transparent: bool,
}

/// Reads a PNG of any kind. Of an animated PNG, it reads the image that programs without support for
/// animation show.
///
/// Each pixel is first blended over [`GROUND`] by its transparency. So colours that hide under full
/// transparency reach neither the scaled texture nor its palette.
///
/// # Errors
/// If the file has another format, which the message names, is damaged, or is larger than [`MAX_PIXELS`].
pub fn read(mut from: impl BufRead + Seek) -> anyhow::Result<OpaqueImage> {
    let begin = from.fill_buf().context("cannot be read")?;
    if !begin.starts_with(PNG) {
        match file_kind::of(begin, None) {
            Some(kind) => bail!("the file is {kind}, not a PNG; convert it to PNG"),
            None if begin.is_empty() => bail!("the file is empty; pass a PNG"),
            None => bail!(
                "the file begins with {}, unlike every PNG; pass a PNG",
                quoted(begin)
            ),
        }
    }
    let damaged = |error| match error {
        // This limit applies to the file's metadata, not to its pixels.
        png::DecodingError::LimitsExceeded => {
            anyhow!(
                "the header or the metadata needs too much memory; save the PNG again without metadata"
            )
        }
        error => anyhow!("the PNG is damaged: {error}; save it again"),
    };
    let mut decoder = Decoder::new(from);
    decoder.set_transformations(Transformations::EXPAND | Transformations::STRIP_16);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // The size comes first, because decoding allocates the memory that the header claims.
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (header.width, header.height);
    ensure!(
        width <= MAX_PIXELS && height <= MAX_PIXELS,
        "the PNG has {width} x {height} pixels, but at most {MAX_PIXELS} on a side are allowed; scale \
         it down"
    );
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    // The decoder refuses a palette of more than 768 bytes, and panics if the palette ends within a colour
    // (png 0.18.1, `create_rgba_palette`).
    let bytes = info.palette.as_deref().unwrap_or_default().len();
    ensure!(
        bytes.is_multiple_of(3),
        "the palette has {bytes} bytes, but needs three for each colour; save the PNG again"
    );
    let size = reader
        .output_buffer_size()
        .context("the PNG is too large")?;
    let mut bytes = vec![0; size];
    let frame = reader.next_frame(&mut bytes).map_err(damaged)?;
    ensure!(
        frame.bit_depth == BitDepth::Eight && (frame.width, frame.height) == (width, height),
        "the first image does not have the size in the header; save the PNG again"
    );
    Ok(over_ground(bytes, frame.color_type, (width, height)))
}

/// Blends a decoder's pixels, with 8 bits a component, over [`GROUND`].
fn over_ground(mut bytes: Vec<u8>, colour: ColorType, (width, height): (u32, u32)) -> OpaqueImage {
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
        // In place, because a copy of the largest image would need a fifth of a GiB.
        for i in 0..pixels {
            let rgb = pixel(&bytes[i * samples..][..samples]);
            bytes[3 * i..][..3].copy_from_slice(&rgb);
        }
    }
    bytes.truncate(3 * pixels);
    let pixels = RgbImage::from_raw(width, height, bytes);
    OpaqueImage {
        pixels: pixels.expect("three bytes a pixel"),
        transparent,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// Returns a PNG of rows of bytes.
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

    fn image(bytes: &[u8]) -> (Vec<u8>, bool) {
        let image = read(Cursor::new(bytes)).unwrap();
        (image.pixels.into_raw(), image.transparent)
    }

    #[test]
    fn every_kind_of_png_is_read_correctly() {
        let palette: &[u8] = &[10, 20, 30, 40, 50, 60, 70, 80, 90];
        let grey = |values: &[u8]| values.iter().flat_map(|&v| [v; 3]).collect::<Vec<_>>();
        use BitDepth::{Eight, Four, One, Sixteen, Two};
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let opaque: &[(ColorType, BitDepth, &[u8], Vec<u8>)] = &[
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
        for (colour, depth, rows, pixels) in opaque {
            let bytes = encoded((3, 1), *colour, *depth, rows, |encoder| {
                if *colour == Indexed {
                    encoder.set_palette(palette);
                }
            });
            assert_eq!(
                image(&bytes),
                (pixels.clone(), false),
                "{colour:?} {depth:?}"
            );
        }
        // Interlaced, in seven passes. `at` defines the pixels.
        let interlaced: Vec<u8> = INTERLACED
            .as_bytes()
            .chunks(2)
            .map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap())
            .collect();
        let at = |x: u8, y: u8| [x * 32, y * 32, (x ^ y) * 16];
        let all = (0..8).flat_map(|y| (0..8).map(move |x| at(x, y)));
        let all: Vec<_> = all.flatten().collect();
        assert_eq!(image(&interlaced), (all, false));
        // Animated: the first image counts.
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(Rgb);
        encoder.set_animated(2, 0).unwrap();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[1, 2, 3]).unwrap();
        writer.write_image_data(&[7, 8, 9]).unwrap();
        writer.finish().unwrap();
        assert_eq!(image(&bytes), (vec![1, 2, 3], false));
    }

    #[test]
    fn transparent_pixels_are_blended_with_grey_and_their_colours_vanish() {
        use BitDepth::{Eight, Sixteen, Two};
        use ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        let [ground, ..] = GROUND;
        // 128/255 of white, and the rest of the ground.
        let half = ((255 * 128 + u32::from(ground) * 127 + 127) / 255) as u8;
        let clear: &[u8] = &[ground; 3];
        type TransparentPng<'a> = (ColorType, BitDepth, &'a [u8], &'a [u8], Vec<u8>);
        let cases: &[TransparentPng] = &[
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
            // Transparent colours. A 16-bit key is one colour, not every colour with the same upper bytes.
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
                image(&bytes),
                (pixels.clone(), true),
                "{colour:?} {depth:?}"
            );
        }
        // The scaler and the quantizer see one colour, whatever was hidden.
        let hidden: Vec<u8> = (0..300u32 * 300)
            .flat_map(|i| [i as u8, (i >> 8) as u8, 255, 0])
            .collect();
        let bytes = encoded((300, 300), Rgba, Eight, &hidden, |_| {});
        let face = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
        let face = crate::obj::parse(face).unwrap();
        let (_, layout) = crate::make_mesh(&face, (300, 300)).unwrap();
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
}
