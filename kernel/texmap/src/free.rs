//! The free direction: along the line of constant depth, wherever it goes.

/// A walk along a line that leaves its row or column pixel by pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Walk {
    /// The texture's coordinates and their steps along the line.
    pub texture: crate::affine::Walk,
    /// How far aside the line is at the first pixel, 16.16 pixels.
    pub aside: i32,
    /// Its step.
    pub slope: i32,
}

impl Walk {
    /// Pixels that pixel `i` lies aside of the first one's row or column.
    pub fn aside(&self, i: u16) -> i16 {
        ((self.aside + self.slope * i32::from(i)) >> 16) as i16
    }
}

impl Iterator for Walk {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        self.texture.next()
    }
}
