//! What the loops keep in registers, how it is made of a walk, and how it steps: the portable
//! twins.
//!
//! Sums wrap: the step after the last pixel may lead anywhere.

use modex::Column;

use crate::Texture;
use crate::affine::{self, Walk};
use crate::loops::Loop;

/// What a loop keeps in registers.
pub(super) trait Registers: Sized {
    /// Their values at the first of `len` pixels, at least one, if the loop is for the texture.
    ///
    /// # Panics
    /// If the walk leaves the texture, unless the loop wraps it around.
    fn new(texture: &Texture<'_>, walk: Walk, len: u16) -> Option<Self>;

    /// The index of the pixel's texel, which the texture has; then it is the next pixel.
    fn next(&mut self) -> usize;
}

/// The registers at the first pixel of a column, if it is one for the loop: an empty one is done
/// with, and in a texture that the loop is not for the clear twin draws it.
#[inline(always)]
pub(super) fn start<'c, R: Registers>(
    texture: &Texture<'_>,
    walk: Walk,
    column: Column<'c>,
) -> Option<(R, Column<'c>)> {
    if column.is_empty() {
        return None;
    }
    match R::new(texture, walk, column.len()) {
        Some(registers) => Some((registers, column)),
        None => {
            unpadded(texture, walk, column);
            None
        }
    }
}

/// By itself, and the walk not lent: the registers are made without it being in memory.
#[inline(never)]
fn unpadded(texture: &Texture<'_>, walk: Walk, column: Column<'_>) {
    affine::column(texture, walk, column);
}

/// Draws a column portably.
pub(super) fn column<R: Registers>(texture: &Texture<'_>, walk: &Walk, column: Column<'_>) {
    let texels = texture.texels();
    if let Some((mut registers, column)) = start::<R>(texture, *walk, column) {
        column.fill(|| texels[registers.next()]);
    }
}

/// Draws a column by the clear twin.
pub(super) fn multiply(texture: &Texture<'_>, walk: &Walk, column: Column<'_>) {
    affine::column(texture, *walk, column);
}

/// A walk that is inside its texture at every pixel of a column: tested at both ends.
#[derive(Clone, Copy)]
struct Inside {
    pitch: u16,
    walk: Walk,
}

impl Inside {
    /// `walk` over `len` pixels, at least one; none in a tiled texture, where an index does not go
    /// on as the walk does.
    ///
    /// # Panics
    /// If it leaves the texture.
    #[inline]
    fn new(texture: &Texture<'_>, walk: Walk, len: u16) -> Option<Self> {
        if texture.tile().is_some() {
            return None;
        }
        let steps = i64::from(len) - 1;
        let inside = |from: i32, step: i32, last: i32| {
            // Without a sign, what is below zero is above all that is inside.
            let to = i64::from(from) + steps * i64::from(step);
            from as u32 <= last as u32 && to as u64 <= last as u64
        };
        let last = texture.last();
        if !(inside(walk.u, walk.du, last.0) && inside(walk.v, walk.dv, last.1)) {
            outside();
        }
        let pitch = texture.pitch();
        Some(Self { pitch, walk })
    }

    /// The first pixel's texel. Both coordinates are at least zero.
    #[inline]
    fn index(&self) -> usize {
        let [row, column] = [self.walk.v, self.walk.u].map(|at| (at as u32 >> 16) as usize);
        row * usize::from(self.pitch) + column
    }

    /// What every step adds to the index, carries apart. Rounded down: the fractions are positive
    /// also where a step is negative, and every carry is one more.
    #[inline]
    fn whole_step(&self) -> isize {
        let Walk { du, dv, .. } = self.walk;
        (dv >> 16) as isize * self.pitch as isize + (du >> 16) as isize
    }
}

#[cold]
fn outside() -> ! {
    panic!("the walk leaves the texture")
}

/// The texel's index and the two fractions of the coordinates, 16 bits at the top of 32.
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
    fn new(texture: &Texture<'_>, walk: Walk, len: u16) -> Option<Self> {
        let inside = Inside::new(texture, walk, len)?;
        let fraction = |at: i32| (at as u32) << 16;
        let Walk { u, v, du, dv } = inside.walk;
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

/// The texel's index, and both fractions in one register: 16 bits of u at the top, 15 of v at the
/// bottom, and between them a bit that takes the carry of v and is cleared every time.
pub(super) struct Halves {
    pub at: usize,
    pub fractions: u32,
    pub step_fractions: u32,
    /// What every step adds to the index; a carry of u adds 1, one of v `pitch`.
    pub step: isize,
    pub pitch: isize,
}

impl Halves {
    /// Where v takes its carry.
    pub const CARRY: u32 = 1 << 15;
}

impl Registers for Halves {
    #[inline]
    fn new(texture: &Texture<'_>, walk: Walk, len: u16) -> Option<Self> {
        let inside = Inside::new(texture, Loop::Packed.walk(walk), len)?;
        let fractions = |u: i32, v: i32| (u as u32) << 16 | (v as u32 & 0xFFFF) >> 1;
        let Walk { u, v, du, dv } = inside.walk;
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

/// The coordinates with the bits of the index at 16 and above: `u_mask` has those of the column,
/// `v_mask` those of the row. Padded textures: the masks together have bits for as many texels as
/// there are.
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
    fn new(texture: &Texture<'_>, walk: Walk, _: u16) -> Option<Self> {
        let masks = texture.masks()?;
        let pitch = u32::from(texture.pitch());
        // At most 8 bits each: v loses none of the 16 of its fraction and the 8 above.
        Some(Self {
            u: walk.u as u32,
            v: (walk.v as u32).wrapping_mul(pitch),
            du: walk.du as u32,
            dv: (walk.dv as u32).wrapping_mul(pitch),
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

/// Both coordinates in one register, and a mask of the index's bits in it. Padded textures: the
/// mask has bits for as many texels as there are.
///
/// u lies at the bottom, and only the bits of it that are inside the padded texture: 16 of fraction
/// and at most 8. A negative step is taken as the positive one that leads to the same column around
/// the texture, so that nothing is ever borrowed. What u carries beyond its bits goes into the
/// 16 free ones above it: a column of 65 535 pixels does not fill them. v lies above those, and
/// what it carries leaves the register, or goes unmasked.
pub(super) struct Joint {
    pub at: u64,
    pub step: u64,
    pub mask: u64,
}

impl Registers for Joint {
    #[inline]
    fn new(texture: &Texture<'_>, walk: Walk, _: u16) -> Option<Self> {
        let mask = texture.masks()?;
        let (pitch, around) = (u64::from(texture.pitch()), mask as u32 | 0xFFFF);
        let join =
            |u: i32, v: i32| (u64::from(v as u32) * pitch) << 32 | u64::from(u as u32 & around);
        Some(Self {
            at: join(walk.u, walk.v),
            step: join(walk.du, walk.dv),
            mask,
        })
    }

    fn next(&mut self) -> usize {
        let index = self.at & self.mask;
        self.at = self.at.wrapping_add(self.step);
        // The row's bits are 32 above where they go on from the column's.
        ((index >> 32 | index) as u32 >> 16) as usize
    }
}

/// Two registers, each with the other's fraction: (fraction of u, row) and (fraction of v, column),
/// 32 bits each. What carries out of the one is what the other's whole texels lack.
///
/// Of the two sums in a step the second's carry comes too late for the first, and waits for the
/// next step. So v's fraction starts a step ahead, and the carry of that first step is kept.
///
/// A step's whole texels may be negative, and are added as one number with the fraction. In a walk
/// inside its texture the sum's are not, so the fraction gets back exactly what it lent. But
/// the *carry* is right only while the step as a whole is not negative, which it would be with
/// a fraction of zero. Therefore each step's fraction is one part in 2^32 more than it ought to be.
/// The 16 bits of the fraction don't notice within 65 535 pixels.
pub(super) struct Crossed {
    /// Bits of a column's number.
    pub columns: u32,
    pub row: u64,
    pub column: u64,
    pub row_step: u64,
    pub column_step: u64,
    /// Of v's fraction.
    pub carry: bool,
}

impl Registers for Crossed {
    #[inline]
    fn new(texture: &Texture<'_>, walk: Walk, len: u16) -> Option<Self> {
        let (columns, _) = texture.bits()?;
        let inside = Inside::new(texture, walk, len)?;
        let fraction = |at: i32| u64::from(at as u32 & 0xFFFF) << 48;
        let whole = |at: i32| i64::from(at >> 16) as u64;
        let one_part = 1 << 32;
        let Walk { u, v, du, dv } = inside.walk;
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
