//! Steppers: the texture coordinates of a span's pixels, as a start and constant steps.

use modex::Column;

use crate::geometry::Texture;

/// Fraction bits of a line's offset across its direction: 320 steps keep it within 2^-14 pixel.
pub(crate) const LINE_FRACTION: u32 = 22;

/// Constant steps through the texture along a span, 16.16: the coordinates at the first pixel, and their
/// steps.
///
/// For every pixel i of its span, `u + i du` and `v + i dv` lie inside the texture: both end values were
/// clamped into the texture and the steps are cut towards zero, so nothing between the ends can leave it. No
/// loop clamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AffineStepper {
    /// Coordinate across the texture, at the first pixel's centre.
    pub u: i32,
    /// Coordinate down the texture, at the first pixel's centre.
    pub v: i32,
    /// Step of `u` from a pixel to the next.
    pub du: i32,
    /// Step of `v` from a pixel to the next.
    pub dv: i32,
}

impl AffineStepper {
    /// Returns the stepper that starts at pixel `pixels` of this stepper and steps by `stride` pixels.
    pub fn every(&self, stride: i32, pixels: i32) -> Self {
        let Self { u, v, du, dv } = *self;
        Self {
            u: u + pixels * du,
            v: v + pixels * dv,
            du: stride * du,
            dv: stride * dv,
        }
    }
}

/// Yields the coordinates, pixel after pixel.
impl Iterator for AffineStepper {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        let here = (self.u, self.v);
        // The last addition steps past the span; |u| and |du| are below 2^25, so it fits.
        self.u += self.du;
        self.v += self.dv;
        Some(here)
    }
}

/// Constant steps down a column that stays in one column of the texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UprightStepper {
    /// Coordinate across the texture, 16.16.
    pub u: i32,
    /// Coordinate down the texture at the first pixel, 16.16.
    pub v: i32,
    /// Step of `v` from a pixel to the next.
    pub dv: i32,
}

impl From<UprightStepper> for AffineStepper {
    fn from(UprightStepper { u, v, dv }: UprightStepper) -> Self {
        Self { u, v, du: 0, dv }
    }
}

impl UprightStepper {
    /// Returns the stepper that starts at pixel `pixels` of this stepper.
    pub(crate) fn after(self, pixels: u16) -> Self {
        Self {
            v: self.v + i32::from(pixels) * self.dv,
            ..self
        }
    }

    /// Draws a column.
    pub(crate) fn column(self, texture: &Texture<'_>, column: Column<'_>) {
        let (u, mut v) = ((self.u >> 16) as usize, self.v);
        column.fill(|| {
            let texel = texture.texel(u, (v >> 16) as usize);
            v += self.dv;
            texel
        });
    }
}

/// The stepper along a line that moves between rows or columns from pixel to pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineStepper {
    /// The texture coordinates, and their steps along the line.
    pub texture: AffineStepper,
    /// The line's offset across its direction at the first pixel: 22 fraction bits, 0 to 1.
    pub offset: i32,
    /// The step of `offset`, -1 to 1.
    pub slope: i32,
}

impl LineStepper {
    /// Returns the offset of pixel `i` from the first pixel's row or column, in pixels.
    pub fn offset_at(&self, i: u16) -> i16 {
        ((self.offset + self.slope * i32::from(i)) >> LINE_FRACTION) as i16
    }

    /// Returns the stepper that starts at pixel `i`, with offsets relative to that pixel's row or column.
    pub(crate) fn after(&self, i: u16) -> Self {
        let offset = self.offset + self.slope * i32::from(i);
        Self {
            texture: self.texture.every(1, i.into()),
            offset: offset & ((1 << LINE_FRACTION) - 1),
            ..*self
        }
    }

    /// Returns how many pixels from `i` on, of `len` in all, lie in the same row or column.
    pub(crate) fn pixels_in_line(&self, i: u16, len: u16) -> u16 {
        let here = self.offset_at(i);
        let end = (i + 1..len).find(|&next| self.offset_at(next) != here);
        end.unwrap_or(len) - i
    }
}

impl Iterator for LineStepper {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        self.texture.next()
    }
}

/// Draws one column and computes the texel's index from scratch for each pixel: the reference implementation
/// of the loops.
#[inline]
pub fn column(texture: &Texture<'_>, mut stepper: AffineStepper, column: Column<'_>) {
    column.fill(|| {
        let (u, v) = (stepper.u, stepper.v);
        stepper = stepper.every(1, 1);
        texture.at(u, v)
    });
}
