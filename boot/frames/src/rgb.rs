//! Images in red, green and blue, such as QEMU's `screendump`.

use std::io::Write;

use anyhow::{Context, bail};

/// An image in red, green and blue, such as the monitor's.
#[derive(Clone, PartialEq, Eq)]
pub struct RgbImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// `width * height` pixels, row by row, 8 bits per component.
    pub pixels: Vec<[u8; 3]>,
}

impl RgbImage {
    /// Reads a binary PPM with 8 bits per colour, the only format that every QEMU writes.
    ///
    /// # Errors
    /// Any other data, and a file that is cut short.
    pub fn from_ppm(bytes: &[u8]) -> anyhow::Result<Self> {
        // Parsed by hand: `frames` depends on no crate that reads PPMs, and QEMU writes one variant only.
        let mut parts = bytes.splitn(4, |byte| byte.is_ascii_whitespace());
        let mut word = || std::str::from_utf8(parts.next()?).ok();
        let (kind, width, height) = (word(), word(), word());
        let number = |word: Option<&str>| word.and_then(|word| word.parse::<usize>().ok());
        let (Some("P6"), Some(width), Some(height)) = (kind, number(width), number(height)) else {
            bail!("not a binary PPM: it must begin with P6, a width and a height");
        };
        let rest = parts.next().unwrap_or_default();
        let Some(rest) = rest.strip_prefix(b"255\n") else {
            bail!("the PPM's colours are not 8 bits wide; the largest value must be 255");
        };
        let (pixels, []) = rest.as_chunks::<3>() else {
            bail!("the PPM is cut short in the middle of a pixel");
        };
        if Some(pixels.len()) != width.checked_mul(height) {
            bail!(
                "the PPM has {} pixels; its header says {width} x {height}",
                pixels.len()
            );
        }
        Ok(Self {
            width,
            height,
            pixels: pixels.to_vec(),
        })
    }

    /// Writes a PNG.
    ///
    /// # Errors
    /// The writer's error.
    pub fn write_png(&self, to: impl Write) -> anyhow::Result<()> {
        let (width, height) = (self.width.try_into()?, self.height.try_into()?);
        let mut encoder = png::Encoder::new(to, width, height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header().context("the PNG's header")?;
        writer.write_image_data(self.pixels.as_flattened())?;
        Ok(writer.finish()?)
    }
}

impl std::fmt::Debug for RgbImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "an RGB image of {} x {}", self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_screendump_is_read_and_a_damaged_screendump_is_refused() {
        let screen = RgbImage::from_ppm(b"P6\n2 1\n255\nabcdef").unwrap();
        assert_eq!((screen.width, screen.height), (2, 1));
        assert_eq!(screen.pixels, [*b"abc", *b"def"]);
        for (bad, why) in [
            (&b""[..], "not a binary PPM"),
            (b"P5\n2 1\n255\nab", "not a binary PPM"),
            (b"P6\n2 -1\n255\n", "not a binary PPM"),
            (b"P6\n2 1\n65535\nabcdef", "8 bits"),
            (b"P6\n2 1\n255\nabcde", "middle of a pixel"),
            (b"P6\n2 1\n255\nabc", "1 pixels; its header says 2 x 1"),
        ] {
            let error = RgbImage::from_ppm(bad).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn a_png_has_the_pixels_that_were_written() {
        let screen = RgbImage::from_ppm(b"P6\n1 2\n255\nabcdef").unwrap();
        let mut file = Vec::new();
        screen.write_png(&mut file).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(file))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, b"abcdef");
    }
}
