//! Frames in palette indices, as a page in video memory and an indexed PNG hold them.

use std::fmt;
use std::io::{BufRead, Seek, Write};

use anyhow::{Context, bail};
use modex::Rgb6;
use vga::widen;

/// A frame whose pixels are indices into its palette.
#[derive(Clone, PartialEq, Eq)]
pub struct IndexedImage {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Up to 256 colours, 6 bits per component.
    pub palette: Vec<Rgb6>,
    /// `width * height` indices, row by row. Each index is inside the palette.
    pub pixels: Vec<u8>,
}

impl fmt::Debug for IndexedImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a frame of {} x {}", self.width, self.height)
    }
}

impl IndexedImage {
    /// Writes an indexed PNG with 8 bits per pixel.
    ///
    /// # Errors
    /// The writer's error.
    pub fn write_png(&self, to: impl Write) -> anyhow::Result<()> {
        let mut encoder = png::Encoder::new(to, self.width.try_into()?, self.height.try_into()?);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        let colours: Vec<u8> = self
            .palette
            .as_flattened()
            .iter()
            .map(|&p| widen(p))
            .collect();
        encoder.set_palette(colours);
        let mut writer = encoder.write_header().context("the PNG's header")?;
        writer.write_image_data(&self.pixels)?;
        Ok(writer.finish()?)
    }

    /// Reads an indexed PNG with 8 bits per pixel.
    ///
    /// # Errors
    /// Any other PNG, a colour that 6 bits per component cannot represent, an index outside the palette.
    pub fn read_png(from: impl BufRead + Seek) -> anyhow::Result<Self> {
        let mut reader = png::Decoder::new(from).read_info()?;
        let info = reader.info();
        let (width, height) = (info.width as usize, info.height as usize);
        let (colour, depth) = (info.color_type, info.bit_depth);
        let (png::ColorType::Indexed, png::BitDepth::Eight) = (colour, depth) else {
            bail!(
                "the PNG has {colour:?} pixels of {} bits; give an indexed PNG of 8 bits, as this \
                 program writes",
                depth as u8
            );
        };
        let parts = info.palette.as_deref().context("the PNG has no palette")?;
        let (colours, rest) = parts.as_chunks::<3>();
        if !rest.is_empty() {
            bail!(
                "the PNG's palette has {} bytes, which is not a multiple of 3",
                parts.len()
            );
        }
        let mut palette = Vec::new();
        for (entry, colour) in colours.iter().enumerate() {
            if let Some(part) = colour.iter().find(|&&part| widen(part >> 2) != part) {
                bail!(
                    "palette entry {entry:02x} has the component {part:02x}, which a VGA cannot show; a \
                     component is a 6-bit value, widened to 8 bits"
                );
            }
            palette.push(colour.map(|part| part >> 2));
        }
        let size = reader
            .output_buffer_size()
            .context("the PNG is too large")?;
        let mut pixels = vec![0; size];
        reader.next_frame(&mut pixels)?;
        // A file that is cut short can contain all pixels and lack the end.
        reader.finish()?;
        if let Some(at) = pixels.iter().position(|&p| usize::from(p) >= palette.len()) {
            bail!(
                "the pixel at x {}, y {} has the index {:02x}; the palette has {} colours",
                at % width,
                at / width,
                pixels[at],
                palette.len()
            );
        }
        Ok(Self {
            width,
            height,
            palette,
            pixels,
        })
    }
}
