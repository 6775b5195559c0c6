//! The registers of the loops: their start values for a stepper, and their steps. These are the portable
//! versions of the loops.
//!
//! Sums wrap: the step after the last pixel may lead anywhere.

use modex::Column;

use super::stepper::{self, AffineStepper};
use crate::geometry::Texture;

/// The values that a loop keeps in registers.
pub(super) trait Registers: Sized {
    /// Returns the values at the first of `len` pixels, at least one, or nothing if the loop does not support
    /// the texture.
    ///
    /// # Panics
    /// If the span leaves the texture, unless the loop wraps it around.
    fn new(texture: &Texture<'_>, stepper: AffineStepper, len: u16) -> Option<Self>;

    /// Returns the index of the current pixel's texel, which the texture has, and steps to the next pixel.
    fn next(&mut self) -> usize;
}

/// Returns the registers at the first pixel of a column, if the loop has to draw it. An empty column needs no
/// drawing. If the loop does not support the texture, the reference implementation draws the column here.
#[inline(always)]
pub(super) fn start<'c, R: Registers>(
    texture: &Texture<'_>,
    stepper: AffineStepper,
    column: Column<'c>,
) -> Option<(R, Column<'c>)> {
    if column.is_empty() {
        return None;
    }
    match R::new(texture, stepper, column.len()) {
        Some(registers) => Some((registers, column)),
        None => {
            unpadded(texture, stepper, column);
            None
        }
    }
}

/// Draws a column of a texture that the loop does not support. A separate function that gets the stepper by
/// value: otherwise the stepper would be stored to memory before the registers are made.
#[inline(never)]
fn unpadded(texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
    stepper::column(texture, stepper, column);
}

/// Draws a column portably.
pub(super) fn column<R: Registers>(
    texture: &Texture<'_>,
    stepper: &AffineStepper,
    column: Column<'_>,
) {
    let texels = texture.texels();
    if let Some((mut registers, column)) = start::<R>(texture, *stepper, column) {
        column.fill(|| texels[registers.next()]);
    }
}

/// Draws a column with the reference implementation.
pub(super) fn multiply(texture: &Texture<'_>, stepper: &AffineStepper, column: Column<'_>) {
    stepper::column(texture, *stepper, column);
}

/// A stepper that is inside its texture at every pixel of a column: tested at both ends.
#[derive(Clone, Copy)]
struct CheckedStepper {
    pitch: u16,
    stepper: AffineStepper,
}

impl CheckedStepper {
    /// Returns `stepper` over `len` pixels, at least one. Returns nothing in a tiled texture, where the index
    /// does not advance as the coordinates do.
    ///
    /// # Panics
    /// If the span leaves the texture.
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, len: u16) -> Option<Self> {
        if texture.tile().is_some() {
            return None;
        }
        let steps = i64::from(len) - 1;
        let inside = |from: i32, step: i32, last: i32| {
            // As an unsigned number, a negative coordinate is above every coordinate inside.
            let to = i64::from(from) + steps * i64::from(step);
            from as u32 <= last as u32 && to as u64 <= last as u64
        };
        let last = texture.last();
        if !(inside(stepper.u, stepper.du, last.0) && inside(stepper.v, stepper.dv, last.1)) {
            outside();
        }
        let pitch = texture.pitch();
        Some(Self { pitch, stepper })
    }

    /// Returns the index of the first pixel's texel. Both coordinates are at least zero.
    #[inline]
    fn index(&self) -> usize {
        let [row, column] = [self.stepper.v, self.stepper.u].map(|at| (at as u32 >> 16) as usize);
        row * usize::from(self.pitch) + column
    }

    /// Returns what every step adds to the index, apart from the carries. The whole parts are rounded down,
    /// so the fractions are positive even for a negative step, and every carry adds one.
    #[inline]
    fn whole_step(&self) -> isize {
        let AffineStepper { du, dv, .. } = self.stepper;
        (dv >> 16) as isize * self.pitch as isize + (du >> 16) as isize
    }
}

#[cold]
fn outside() -> ! {
    panic!("the span leaves the texture")
}

/// The texel's index, and the fractions of both coordinates, 16 bits at the top of 32.
pub(super) struct Address {
    pub at: usize,
    pub u: u32,
    pub v: u32,
    pub du: u32,
    pub dv: u32,
    /// What a step adds to the index if v carries, and if it does not.
    pub steps: [isize; 2],
}

impl Registers for Address {
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, len: u16) -> Option<Self> {
        let inside = CheckedStepper::new(texture, stepper, len)?;
        let fraction = |at: i32| (at as u32) << 16;
        let AffineStepper { u, v, du, dv } = inside.stepper;
        let step = inside.whole_step();
        Some(Self {
            at: inside.index(),
            u: fraction(u),
            v: fraction(v),
            du: fraction(du),
            dv: fraction(dv),
            steps: [step + inside.pitch as isize, step],
        })
    }

    fn next(&mut self) -> usize {
        let at = self.at;
        let (u, u_carry) = self.u.overflowing_add(self.du);
        let (v, v_carry) = self.v.overflowing_add(self.dv);
        (self.u, self.v) = (u, v);
        let step = self.steps[usize::from(!v_carry)];
        self.at = at.wrapping_add_signed(step + isize::from(u_carry));
        at
    }
}

/// The texel's index, and both fractions in one register: 16 bits of u at the top, 15 bits of v at the
/// bottom, and between them a bit that receives the carry of v and is cleared at every step.
pub(super) struct Halves {
    pub at: usize,
    pub fractions: u32,
    pub step_fractions: u32,
    /// What every step adds to the index. A carry of u adds 1, and a carry of v adds `pitch`.
    pub step: isize,
    pub pitch: isize,
}

impl Halves {
    /// The bit that receives the carry of v.
    pub const CARRY: u32 = 1 << 15;

    /// Returns `stepper` without the last bit of v and of v's step, which is cut towards zero.
    pub fn effective(stepper: AffineStepper) -> AffineStepper {
        AffineStepper {
            v: stepper.v & !1,
            dv: stepper.dv - stepper.dv % 2,
            ..stepper
        }
    }
}

impl Registers for Halves {
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, len: u16) -> Option<Self> {
        let inside = CheckedStepper::new(texture, Self::effective(stepper), len)?;
        let fractions = |u: i32, v: i32| (u as u32) << 16 | (v as u32 & 0xFFFF) >> 1;
        let AffineStepper { u, v, du, dv } = inside.stepper;
        Some(Self {
            at: inside.index(),
            fractions: fractions(u, v),
            step_fractions: fractions(du, dv),
            step: inside.whole_step(),
            pitch: inside.pitch as isize,
        })
    }

    fn next(&mut self) -> usize {
        let at = self.at;
        let (fractions, u_carry) = self.fractions.overflowing_add(self.step_fractions);
        let v_carry = fractions & Self::CARRY != 0;
        self.fractions = fractions & !Self::CARRY;
        let row = if v_carry { self.pitch } else { 0 };
        self.at = at.wrapping_add_signed(self.step + isize::from(u_carry) + row);
        at
    }
}

/// The coordinates, with the bits of the index at bit 16 and above: `u_mask` selects the column's bits and
/// `v_mask` the row's. Padded textures: the two masks together address exactly the texture's texels.
pub(super) struct Pair {
    pub u: u32,
    pub v: u32,
    pub du: u32,
    pub dv: u32,
    pub u_mask: u32,
    pub v_mask: u32,
}

impl Registers for Pair {
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, _: u16) -> Option<Self> {
        let masks = texture.masks()?;
        let pitch = u32::from(texture.pitch());
        // Rows and columns have at most 8 bits each, so v keeps the 16 bits of its fraction and the 8 above.
        Some(Self {
            u: stepper.u as u32,
            v: (stepper.v as u32).wrapping_mul(pitch),
            du: stepper.du as u32,
            dv: (stepper.dv as u32).wrapping_mul(pitch),
            u_mask: masks as u32,
            v_mask: (masks >> 32) as u32,
        })
    }

    fn next(&mut self) -> usize {
        let index = ((self.v & self.v_mask) | (self.u & self.u_mask)) >> 16;
        self.u = self.u.wrapping_add(self.du);
        self.v = self.v.wrapping_add(self.dv);
        index as usize
    }
}

/// Both coordinates in one register, and a mask of the index's bits in it. Padded textures: the mask
/// addresses exactly the texture's texels.
///
/// u lies at the bottom, with only the bits that are inside the padded texture: 16 of fraction and at most 8
/// above. A negative step is replaced by the positive step that leads to the same column around the texture,
/// so nothing is ever borrowed. Carries of u beyond its bits go into the 16 free bits above, which a column
/// of 65 535 pixels does not fill. v lies above the free bits, and its carries leave the register or are
/// masked out.
pub(super) struct Joint {
    pub at: u64,
    pub step: u64,
    pub mask: u64,
}

impl Registers for Joint {
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, _: u16) -> Option<Self> {
        let mask = texture.masks()?;
        let (pitch, around) = (u64::from(texture.pitch()), mask as u32 | 0xFFFF);
        let join =
            |u: i32, v: i32| (u64::from(v as u32) * pitch) << 32 | u64::from(u as u32 & around);
        Some(Self {
            at: join(stepper.u, stepper.v),
            step: join(stepper.du, stepper.dv),
            mask,
        })
    }

    fn next(&mut self) -> usize {
        let index = self.at & self.mask;
        self.at = self.at.wrapping_add(self.step);
        // The row's bits are 32 above the place where they continue the column's.
        ((index >> 32 | index) as u32 >> 16) as usize
    }
}

/// Two registers, each with the other coordinate's fraction: (fraction of u, row) and (fraction of v,
/// column), 32 bits each. The carry out of one register is what the other's whole texels lack.
///
/// A step has two sums, and the carry of the second comes too late for the first: it waits for the next step.
/// So v's fraction starts one step ahead, and the carry of that first step is kept.
///
/// A step's whole texels may be negative, and are added together with the fraction as a single number. In a
/// span inside its texture the whole texels of the sum are not negative, so the fraction gets back exactly
/// the units that it lent. But the *carry* is right only while the step as a number is not negative, which it
/// would be with negative whole texels and a fraction of zero. Therefore each step's fraction is too large by
/// one part in 2^32. That does not reach the fraction's 16 bits within 65 535 pixels.
pub(super) struct Crossed {
    /// Bits of a column's number.
    pub columns: u32,
    pub row: u64,
    pub column: u64,
    pub row_step: u64,
    pub column_step: u64,
    /// Pending carry of v's fraction.
    pub carry: bool,
}

impl Registers for Crossed {
    #[inline]
    fn new(texture: &Texture<'_>, stepper: AffineStepper, len: u16) -> Option<Self> {
        let (columns, _) = texture.bits()?;
        let inside = CheckedStepper::new(texture, stepper, len)?;
        let fraction = |at: i32| u64::from(at as u32 & 0xFFFF) << 48;
        let whole = |at: i32| i64::from(at >> 16) as u64;
        let one_part = 1 << 32;
        let AffineStepper { u, v, du, dv } = inside.stepper;
        let v_step = fraction(dv) + one_part;
        let (v_ahead, carry) = fraction(v).overflowing_add(v_step);
        Some(Self {
            columns,
            row: fraction(u) + whole(v),
            column: v_ahead + whole(u),
            row_step: (fraction(du) + one_part).wrapping_add(whole(dv)),
            column_step: v_step.wrapping_add(whole(du)),
            carry,
        })
    }

    fn next(&mut self) -> usize {
        let index = ((self.row as u32) << self.columns).wrapping_add(self.column as u32);
        let (row, u_carry) = self.row.carrying_add(self.row_step, self.carry);
        let (column, v_carry) = self.column.carrying_add(self.column_step, u_carry);
        (self.row, self.column, self.carry) = (row, column, v_carry);
        index as usize
    }
}
