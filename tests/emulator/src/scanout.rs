//! The picture as the monitor shows it.

use crate::Vga;
use crate::fault::Complaint;

/// What a frame shows, a colour for every dot: 640x480 in Mode X, each pixel two by two.
#[derive(Clone, PartialEq, Eq)]
pub struct Picture {
    /// Dots across.
    pub width: usize,
    /// Scan lines.
    pub height: usize,
    /// `width * height` colours, 6 bits each of red, green and blue, row by row.
    pub dots: Vec<[u8; 3]>,
}

impl Picture {
    pub(crate) fn of(card: &Vga) -> Result<Self, Complaint> {
        card.sequencer.check_picture()?;
        card.attribute.check_picture(card.graphics.is_graphics())?;
        let geometry = card.crtc.geometry()?;
        let Some(start) = card.crtc.shown_address() else {
            return Err((
                "no frame was begun",
                "the beam never came to a retrace".into(),
            ));
        };
        // A 256-colour pixel takes two dots.
        let width = 2 * geometry.width;
        let mut dots = Vec::with_capacity(width * geometry.lines);
        for line in 0..geometry.lines {
            let y = line / geometry.repeat;
            for x in 0..geometry.width {
                let offset = y * geometry.stride + x / 4;
                // The address counter is 16 bits wide: it wraps within the plane.
                let at = start.wrapping_add(offset as u16);
                let pixel = card.attribute.colour(card.memory.peek(x & 3, at));
                dots.extend([card.dac.colour(pixel)?; 2]);
            }
        }
        Ok(Self {
            width,
            height: geometry.lines,
            dots,
        })
    }
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "a picture of {} x {} dots", self.width, self.height)
    }
}
