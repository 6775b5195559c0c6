//! The affine column loops: several ways to step the same walk.
//!
//! Each loop draws a walk inside the texture with exactly the texels of its reference
//! implementation, [`affine::column`](crate::affine::column). A loop with fewer bits than the walk
//! draws the texels that the reference implementation draws for [`Loop::walk`]. On x86-64 a loop is
//! written in assembly. On other CPUs, and in [`Loop::portable`] everywhere, plain Rust steps the
//! same registers.
//!
//! # Why no loop checks what it reads
//!
//! A bounds check at every pixel would cost more than the step. Two arguments replace it. Both hold
//! for any input, so drawing a column stays safe:
//!
//! - *Checked at both ends.* [`Loop::TwoCarries`], [`Loop::Packed`], [`Loop::TwoSteps`] and
//!   [`Loop::AddCarry`] keep an address or whole texels. The coordinates of the first and the last
//!   pixel are tested once per column, as the loop steps them. A walk is linear, so every pixel
//!   between lies inside the texture, too. The step after the last pixel may leave the texture, but
//!   nothing is read there. A walk that fails the test panics.
//! - *Masked.* [`Loop::Shifts`], [`Loop::Joined`] and [`Loop::Extract`] build the index from as
//!   many bits of each coordinate as a padded texture has columns and rows, so no index can leave
//!   the texture. They draw any walk.
//!
//! A loop writes the column and nothing else: the column's length counts the stores.
//!
//! # Wrap-around
//!
//! A masked loop reads column `(u >> 16) mod pitch` and row `(v >> 16) mod rows`, where pitch and
//! rows are those of the *padded* texture, and u and v wrap at 2^32. So a texture whose sides are
//! not powers of two shows its padding. A negative step works, because no bits of one coordinate
//! can run into the other.

use modex::Column;

use crate::affine::Walk;
use crate::places::Part;
use crate::{Texture, plane, runs};
use steps::{Address, Crossed, Halves, Joint, Pair, Registers};

mod steps;
#[cfg(target_arch = "x86_64")]
mod tuned;

/// A function that draws a column, and panics as [`Loop::column`] does.
pub(crate) type Draw = fn(&Texture<'_>, &Walk, Column<'_>);

/// A function that draws a column in linear pieces, each with a [`Draw`].
pub(crate) type DrawLinear = fn(&Texture<'_>, &plane::Walk, runs::Pieces, Draw, Column<'_>);

/// A way to step a walk down a column.
///
/// The numbers of instructions are per pixel of a long column, on x86-64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loop {
    /// Computes the texel's index from scratch for every pixel: the reference implementation.
    Multiply,
    /// An address and two fractions, with a test of each carry (chapter 58's first column loop). 7
    /// to 9 instructions; 2 of them are branches that texture and step make hard to predict.
    TwoCarries,
    /// Both fractions in one register, one branch (chapter 58's last loop). 6 to 8 instructions,
    /// and a fraction of 15 bits down the texture: see [`Loop::walk`].
    Packed,
    /// The carry selects one of two steps, without a branch (chapter 58's guess of John Miles's
    /// method). 6 instructions.
    TwoSteps,
    /// Two accumulators, shifts and masks; padded textures. 10 instructions, none of which needs a
    /// flag.
    #[default]
    Shifts,
    /// One accumulator for both coordinates, shifts and masks; padded textures. 9 instructions.
    Joined,
    /// Each register holds one coordinate's texels and the other's fraction, stepped by
    /// add-with-carry; padded textures (Barrett's loop without wrap-around). 6 instructions for a
    /// pitch of 256 texels, or of at most 8; 7 or 8 instructions between.
    AddCarry,
    /// One accumulator, with the CPU's bit-extract for the index; padded textures, a CPU with BMI2.
    /// 4 instructions. (AMD's CPUs before Zen 3 have BMI2 but split the extract into many
    /// operations: it is slow there.)
    Extract,
}

impl Loop {
    /// All loops.
    pub const ALL: [Self; 8] = [
        Self::Multiply,
        Self::TwoCarries,
        Self::Packed,
        Self::TwoSteps,
        Self::Shifts,
        Self::Joined,
        Self::AddCarry,
        Self::Extract,
    ];

    /// Returns whether the loop supports padded textures only. It draws other textures as
    /// [`Loop::Multiply`] does.
    pub fn needs_padding(self) -> bool {
        matches!(
            self,
            Self::Shifts | Self::Joined | Self::AddCarry | Self::Extract
        )
    }

    /// Returns the fastest loop for padded textures on this CPU: bit-extract if the CPU has it,
    /// otherwise the loop that is fastest under QEMU's TCG.
    pub fn fastest() -> Self {
        match Self::Extract.is_tuned_here() {
            true => Self::Extract,
            false => Self::Shifts,
        }
    }

    /// Returns whether this CPU runs the loop's own instructions, rather than its portable version.
    /// The texels are the same.
    pub fn is_tuned_here(self) -> bool {
        match self {
            Self::Multiply => true,
            #[cfg(target_arch = "x86_64")]
            Self::Extract => tuned::has_extract(),
            _ => cfg!(target_arch = "x86_64"),
        }
    }

    /// Returns the walk that the loop actually steps for `walk`: it reads at these coordinates.
    ///
    /// Only [`Loop::Packed`] has fewer bits. It drops the last bit of v and of v's step. The step
    /// is cut towards zero, so the walk stays as far inside the texture as before. After i pixels v
    /// is off by at most (i + 1) 2^-16 texel, so by n 2^-16 over a column of n pixels. That adds to
    /// the walk's own n 2^-16; together they are the drift of 15 bits, n 2^-15. It is less than
    /// 0.0074 texel over 240 pixels, and passes 1/256 texel after 128.
    pub fn walk(self, walk: Walk) -> Walk {
        match self {
            Self::Packed => Walk {
                v: walk.v & !1,
                dv: walk.dv - walk.dv % 2,
                ..walk
            },
            _ => walk,
        }
    }

    /// Draws a column.
    ///
    /// # Panics
    /// If the walk leaves the texture, unless the loop wraps it around.
    #[inline]
    pub fn column(self, texture: &Texture<'_>, walk: Walk, column: Column<'_>) {
        self.draw()(texture, &walk, column);
    }

    /// Draws a column with the loop's portable version: the same registers and the same bits, on
    /// any CPU.
    ///
    /// # Panics
    /// As [`Loop::column`].
    pub fn portable(self, texture: &Texture<'_>, walk: Walk, column: Column<'_>) {
        self.draw_portably()(texture, &walk, column);
    }

    /// Returns the function that draws a column on this CPU. Call this once for many columns.
    pub(crate) fn draw(self) -> Draw {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::TwoCarries => {
                return |texture, walk, column| tuned::two_carries(texture, *walk, column);
            }
            Self::Packed => return |texture, walk, column| tuned::packed(texture, *walk, column),
            Self::TwoSteps => {
                return |texture, walk, column| tuned::two_steps(texture, *walk, column);
            }
            Self::Shifts => return |texture, walk, column| tuned::shifts(texture, *walk, column),
            Self::Joined => return |texture, walk, column| tuned::joined(texture, *walk, column),
            Self::AddCarry => {
                return |texture, walk, column| tuned::add_carry(texture, *walk, column);
            }
            Self::Extract if tuned::has_extract() => {
                return |texture, walk, column| tuned::extract(texture, *walk, column);
            }
            Self::Extract | Self::Multiply => {}
        }
        self.draw_portably()
    }

    /// Returns the function that draws a column in linear pieces on this CPU. The fastest loops for
    /// padded textures draw the pieces in place; the others use [`Loop::draw`].
    pub(crate) fn draw_linear(self) -> DrawLinear {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::Shifts => {
                return |texture, walk, pieces, draw, column| {
                    runs::linear(texture, walk, pieces, draw, tuned::shifts_eights, column);
                };
            }
            Self::Extract if tuned::has_extract() => {
                return |texture, walk, pieces, draw, column| {
                    runs::linear(texture, walk, pieces, draw, tuned::extract_eights, column);
                };
            }
            _ => {}
        }
        |texture, walk, pieces, draw, column| {
            let inline =
                |texture: &Texture<'_>, walk, pixels: Column<'_>| draw(texture, &walk, pixels);
            runs::linear(texture, walk, pieces, draw, inline, column);
        }
    }

    /// Writes the texels of a walk along a row, which are the same for every loop, to `places`.
    /// `extract` says whether to use the instructions of [`Loop::Extract`], which the CPU must
    /// have.
    #[inline(always)]
    pub(crate) fn along(texture: &Texture<'_>, mut walk: Walk, extract: bool, places: impl Part) {
        let texels = texture.texels();
        match Joint::new(texture, walk, 0) {
            #[cfg(target_arch = "x86_64")]
            Some(joint) if extract => tuned::along(texels, joint, places),
            Some(mut joint) => places.fill(|| texels[joint.next()]),
            None => places.fill(|| {
                let (u, v) = (walk.u, walk.v);
                walk = walk.every(1, 1);
                texture.at(u, v)
            }),
        }
    }

    fn draw_portably(self) -> Draw {
        match self {
            Self::Multiply => steps::multiply,
            Self::TwoCarries | Self::TwoSteps => steps::column::<Address>,
            Self::Packed => steps::column::<Halves>,
            Self::Shifts => steps::column::<Pair>,
            Self::Joined | Self::Extract => steps::column::<Joint>,
            Self::AddCarry => steps::column::<Crossed>,
        }
    }
}
