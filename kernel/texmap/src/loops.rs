//! The affine column loops: one walk, several ways to step it.
//!
//! Each takes a walk inside the texture and draws the texels of its clear twin,
//! [`affine::column`](crate::affine::column), bit for bit; where a loop has fewer bits than the
//! walk, the twin draws [`Loop::walk`]. On x86-64 a loop is written out in instructions; on other
//! CPUs, and as [`Loop::portable`] everywhere, the same registers are stepped in plain Rust.
//!
//! # Why no loop checks what it reads
//!
//! A bounds check at every pixel would cost more than the step does. There are two ways around it,
//! and both hold for any input, so that drawing a column stays safe:
//!
//! - *Checked at both ends.* [`Loop::TwoCarries`], [`Loop::Packed`], [`Loop::TwoSteps`] and
//!   [`Loop::AddCarry`] keep an address or whole texels. The coordinates of the first pixel and of
//!   the last are tested once for a column, as the loop steps them; a walk is linear, so that
//!   every pixel between lies inside the texture, too. The step after the last pixel may lead out
//!   of it, but nothing is read there. A walk that fails the test panics.
//! - *Masked.* [`Loop::Shifts`], [`Loop::Joined`] and [`Loop::Extract`] put the index together from
//!   as many bits of either coordinate as a padded texture has columns and rows: no index can leave
//!   it. They draw any walk.
//!
//! What is written is the column and nothing else: its length counts the stores.
//!
//! # Wrap-around
//!
//! A masked loop reads column `(u >> 16) mod pitch` and row `(v >> 16) mod rows`, with pitch and
//! rows those of the *padded* texture, and u and v wrapping at 2^32: a texture whose sides are no
//! powers of two shows its padding. A negative step is right, because no coordinate's bits can run
//! into the other's.

use modex::Column;

use crate::affine::Walk;
use crate::places::Part;
use crate::{Texture, plane, runs};
use steps::{Address, Crossed, Halves, Joint, Pair, Registers};

mod steps;
#[cfg(target_arch = "x86_64")]
mod tuned;

/// Draws a column; panics as [`Loop::column`] does.
pub(crate) type Draw = fn(&Texture<'_>, &Walk, Column<'_>);

/// Draws a column in linear pieces, each by a [`Draw`].
pub(crate) type DrawLinear = fn(&Texture<'_>, &plane::Walk, runs::Pieces, Draw, Column<'_>);

/// A way to step a walk down a column.
///
/// Instructions are those of a pixel in a long column, on x86-64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loop {
    /// The texel's index multiplied out for every pixel: the clear twin.
    Multiply,
    /// An address and two fractions, each carry tested (chapter 58's first column loop). 7 to 9
    /// instructions, 2 of them branches that texture and step make hard to foresee.
    TwoCarries,
    /// Both fractions in one register, one branch (its last). 6 to 8 instructions, and a fraction
    /// of 15 bits down the texture: see [`Loop::walk`].
    Packed,
    /// The carry picks one of two steps, no branch (as chapter 58 guesses that John Miles did). 6
    /// instructions.
    TwoSteps,
    /// Two accumulators, shifts and masks; padded textures. 10 instructions, none of which needs
    /// a flag.
    #[default]
    Shifts,
    /// One accumulator for both coordinates, shifts and masks; padded textures. 9 instructions.
    Joined,
    /// Each register with the other's fraction, by add-with-carry; padded textures (Barrett's loop
    /// without wrap-around). 6 instructions for a pitch of 256 texels, or of 8 and less; 7 or 8
    /// between.
    AddCarry,
    /// One accumulator, the index by the CPU's bit-extract; padded textures, a CPU with BMI2. 4
    /// instructions. (AMD's before Zen 3 have BMI2, but take the extract apart: slow there.)
    Extract,
}

impl Loop {
    /// All of them.
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

    /// Whether it is for padded textures only. Others it draws as [`Loop::Multiply`].
    pub fn needs_padding(self) -> bool {
        matches!(
            self,
            Self::Shifts | Self::Joined | Self::AddCarry | Self::Extract
        )
    }

    /// The fastest loop for padded textures on this CPU: bit-extract where there is one, else what
    /// is fastest under QEMU's TCG.
    pub fn fastest() -> Self {
        match Self::Extract.is_tuned_here() {
            true => Self::Extract,
            false => Self::Shifts,
        }
    }

    /// Whether this CPU draws with the loop's own instructions, rather than with its portable
    /// twin. The texels are the same.
    pub fn is_tuned_here(self) -> bool {
        match self {
            Self::Multiply => true,
            #[cfg(target_arch = "x86_64")]
            Self::Extract => tuned::has_extract(),
            _ => cfg!(target_arch = "x86_64"),
        }
    }

    /// The walk that the loop really takes for `walk`: at its coordinates it reads.
    ///
    /// Only [`Loop::Packed`] has fewer bits: v and its step lose their last, the step towards zero,
    /// so that the walk stays as far inside the texture as it was. After i pixels v is off by at
    /// most (i + 1) 2^-16 texel, over a column of n by n 2^-16, which comes on top of the walk's
    /// own n 2^-16: together the drift of 15 bits, n 2^-15. That is less than 0.0074 over 240, and
    /// passes 1/256 texel after 128.
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

    /// Draws a column with the loop's portable twin: the same registers, the same bits, on any
    /// CPU.
    ///
    /// # Panics
    /// As [`Loop::column`].
    pub fn portable(self, texture: &Texture<'_>, walk: Walk, column: Column<'_>) {
        self.draw_portably()(texture, &walk, column);
    }

    /// What draws a column on this CPU: asked once for many of them.
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

    /// What draws a column in linear pieces on this CPU. By the loops that are the fastest for
    /// padded textures the pieces are drawn in place, by the others with [`Loop::draw`].
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

    /// Puts the texels of a walk along a row, which are any loop's, into their places; `extract`
    /// tells whether by the instructions of [`Loop::Extract`], which the CPU must have.
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
