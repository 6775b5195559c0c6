//! An image of the screen, in the form of QEMU's `screendump`.

use std::io::Write;

use anyhow::{Context, bail};

/// The image that the monitor shows: 8 bits each of red, green and blue, row by row.
#[derive(Clone, PartialEq, Eq)]
pub struct RgbImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// `width * height` pixels.
    pub pixels: Vec<[u8; 3]>,
}

impl RgbImage {
    /// Reads a binary PPM with 8 bits per colour, the only format that every QEMU writes.
    ///
    /// # Errors
    /// Any other data, and a file that is cut short.
    pub fn from_ppm(bytes: &[u8]) -> anyhow::Result<Self> {
        let mut parts = bytes.splitn(4, |byte| byte.is_ascii_whitespace());
        let mut word = || std::str::from_utf8(parts.next()?).ok();
        let (kind, width, height) = (word(), word(), word());
        let number = |word: Option<&str>| word.and_then(|word| word.parse::<usize>().ok());
        let (Some("P6"), Some(width), Some(height)) = (kind, number(width), number(height)) else {
            bail!("it does not begin as a binary PPM with its size");
        };
        let rest = parts.next().unwrap_or_default();
        let Some(rest) = rest.strip_prefix(b"255\n") else {
            bail!("its colours are not 8 bits wide");
        };
        let (pixels, []) = rest.as_chunks::<3>() else {
            bail!("it ends in the middle of a pixel");
        };
        if Some(pixels.len()) != width.checked_mul(height) {
            bail!("it has {} pixels, not {width} x {height}", pixels.len());
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
        write!(f, "a screen of {} x {}", self.width, self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_qemu_writes_and_nothing_less() {
        let screen = RgbImage::from_ppm(b"P6\n2 1\n255\nabcdef").unwrap();
        assert_eq!((screen.width, screen.height), (2, 1));
        assert_eq!(screen.pixels, [*b"abc", *b"def"]);
        for (bad, why) in [
            (&b""[..], "begin as a binary PPM"),
            (b"P5\n2 1\n255\nab", "begin as a binary PPM"),
            (b"P6\n2 -1\n255\n", "begin as a binary PPM"),
            (b"P6\n2 1\n65535\nabcdef", "8 bits"),
            (b"P6\n2 1\n255\nabcde", "middle of a pixel"),
            (b"P6\n2 1\n255\nabc", "1 pixels, not 2 x 1"),
        ] {
            let error = RgbImage::from_ppm(bad).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn a_png_comes_back() {
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
