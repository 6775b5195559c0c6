//! The image that the monitor shows.

use crate::attribute::Attribute;
use crate::crtc::Crtc;
use crate::dac::Dac;
use crate::fault::Complaint;
use crate::graphics::Graphics;
use crate::memory::Memory;
use crate::sequencer::Sequencer;

/// The blocks of the chip that determine the image.
pub(crate) struct DisplayBlocks<'a> {
    pub sequencer: &'a Sequencer,
    pub graphics: &'a Graphics,
    pub crtc: &'a Crtc,
    pub attribute: &'a Attribute,
    pub dac: &'a Dac,
    pub memory: &'a Memory,
}

/// The page on the screen, in palette indices, each pixel once.
#[derive(Clone, PartialEq, Eq)]
pub struct DisplayedPage {
    /// The start address that the CRTC has latched.
    pub start: u16,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `width * height` indices, row by row.
    pub pixels: Vec<u8>,
    /// The DAC's colours, 6 bits each of red, green and blue.
    pub palette: [[u8; 3]; 256],
    /// Scan lines for each line of pixels.
    repeat: usize,
}

/// The image on the monitor, a colour for every dot: 640x480 in Mode X, where each pixel is two by two dots.
#[derive(Clone, PartialEq, Eq)]
pub struct MonitorImage {
    /// Dots across.
    pub width: usize,
    /// Scan lines.
    pub height: usize,
    /// `width * height` colours, 6 bits each of red, green and blue, row by row.
    pub dots: Vec<[u8; 3]>,
}

impl DisplayedPage {
    pub(crate) fn of(blocks: &DisplayBlocks) -> Result<Self, Complaint> {
        blocks.sequencer.check_display()?;
        blocks
            .attribute
            .check_display(blocks.graphics.is_graphics())?;
        let timing = blocks.crtc.timing()?;
        // A pixel in a 256-colour mode is two of the 8 dots of a character wide.
        let (width, height) = (timing.across.shown * 4, timing.down.shown / timing.repeat);
        let Some(start) = blocks.crtc.shown_address() else {
            return Err((
                "no frame was begun",
                "the beam has not reached a retrace".into(),
            ));
        };
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let offset = y * timing.stride + x / 4;
                // The address counter is 16 bits wide: it wraps within the plane.
                let at = start.wrapping_add(offset as u16);
                pixels.push(blocks.attribute.colour(blocks.memory.peek(x & 3, at)));
            }
        }
        let mut palette = [[0; 3]; 256];
        for (index, colour) in (0..=255).zip(&mut palette) {
            *colour = blocks.dac.colour(index)?;
        }
        Ok(Self {
            start,
            width,
            height,
            pixels,
            palette,
            repeat: timing.repeat,
        })
    }

    /// Returns the monitor's image of this page.
    pub fn scan_out(&self) -> MonitorImage {
        // A pixel in a 256-colour mode is two dots wide.
        let width = 2 * self.width;
        let height = self.height * self.repeat;
        let mut dots = Vec::with_capacity(width * height);
        for line in 0..height {
            let row = &self.pixels[line / self.repeat * self.width..][..self.width];
            dots.extend(
                row.iter()
                    .flat_map(|&pixel| [self.palette[usize::from(pixel)]; 2]),
            );
        }
        MonitorImage {
            width,
            height,
            dots,
        }
    }
}

impl std::fmt::Debug for DisplayedPage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            width,
            height,
            start,
            ..
        } = self;
        write!(f, "a page of {width} x {height} at {start:04x}")
    }
}

impl std::fmt::Debug for MonitorImage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a frame of {} x {} dots", self.width, self.height)
    }
}
