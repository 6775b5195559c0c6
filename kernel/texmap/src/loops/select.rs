//! The affine column loops: several ways to make the same steps.
//!
//! Each loop draws steps inside the texture with exactly the texels of its reference implementation,
//! [`column`](super::stepper::column). A loop with fewer bits than the stepper draws the texels that the
//! reference implementation draws for [`Loop::effective`]. On x86-64 a loop is written in assembly. On other
//! CPUs, and in [`Loop::portable`] everywhere, plain Rust steps the same registers.
//!
//! # Why no loop checks what it reads
//!
//! A bounds check at every pixel would cost more than the step. Two arguments replace it. Both hold for any
//! input, so drawing a column stays safe:
//!
//! - *Checked at both ends.* [`Loop::TwoCarries`], [`Loop::Packed`], [`Loop::StepTable`] and
//!   [`Loop::AddCarry`] keep an address or whole texels. The coordinates of the first and the last
//!   pixel are tested once per column, as the loop steps them. The steps are constant, so every
//!   pixel between lies inside the texture, too. The step after the last pixel may leave the
//!   texture, but nothing is read there. A stepper that fails the test panics.
//! - *Masked.* [`Loop::Shifts`], [`Loop::OneAccumulator`] and [`Loop::Extract`] build the index
//!   from as many bits of each coordinate as a padded texture has columns and rows, so no index can
//!   leave the texture. They draw any stepper.
//!
//! A loop writes the column and nothing else: the column's length counts the stores.
//!
//! # Wrap-around
//!
//! A masked loop reads column `(u >> 16) mod pitch` and row `(v >> 16) mod rows`, where pitch and rows are
//! those of the *padded* texture, and u and v wrap at 2^32. So a texture whose sides are not powers of two
//! shows its padding. A negative step works, because no bits of one coordinate can run into the other.

use modex::Column;

use super::registers::{self, Address, Crossed, Halves, Joint, Pair, Registers};
use super::sink::PixelSink;
use super::stepper::AffineStepper;
#[cfg(target_arch = "x86_64")]
use super::{cpu, tuned};
use crate::geometry::Texture;

/// A function that draws a column, and panics as [`Loop::column`] does.
pub(crate) type Draw = fn(&Texture<'_>, &AffineStepper, Column<'_>);

/// A way to step through the texture down a column.
///
/// The numbers of instructions are per pixel of a long column, on x86-64.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Loop {
    /// Computes the texel's index from scratch for every pixel: the reference implementation.
    Multiply,
    /// An address and two fractions, with a test of each carry (chapter 58's first column loop). 7 to 9
    /// instructions; 2 of them are branches that texture and step make hard to predict.
    TwoCarries,
    /// Both fractions in one register, one branch (chapter 58's last loop). 6 to 8 instructions, and a
    /// fraction of 15 bits down the texture: see [`Loop::effective`].
    Packed,
    /// The carry selects one of two steps, without a branch (chapter 58's guess of John Miles's method). 6
    /// instructions.
    StepTable,
    /// Two accumulators, shifts and masks; padded textures. 10 instructions, which need no CPU flag.
    #[default]
    Shifts,
    /// One accumulator for both coordinates, shifts and masks; padded textures. 9 instructions.
    OneAccumulator,
    /// Each register holds one coordinate's texels and the other's fraction, stepped by add-with-carry;
    /// padded textures (Barrett's loop without wrap-around). 6 instructions for a pitch of 256 texels, or of
    /// at most 8; 7 or 8 instructions between.
    AddCarry,
    /// One accumulator, with the CPU's bit-extract for the index; padded textures, a CPU with BMI2. 4
    /// instructions. (AMD's CPUs before Zen 3 have BMI2 but split the extract into many operations: it is
    /// slow there.)
    Extract,
}

impl Loop {
    /// All loops.
    pub const ALL: [Self; 8] = [
        Self::Multiply,
        Self::TwoCarries,
        Self::Packed,
        Self::StepTable,
        Self::Shifts,
        Self::OneAccumulator,
        Self::AddCarry,
        Self::Extract,
    ];

    /// Returns whether the loop supports padded textures only. It draws other textures as
    /// [`Loop::Multiply`] does.
    pub fn needs_padding(self) -> bool {
        matches!(
            self,
            Self::Shifts | Self::OneAccumulator | Self::AddCarry | Self::Extract
        )
    }

    /// Returns the fastest loop for padded textures on this CPU: bit-extract if the CPU has it, otherwise the
    /// loop that is fastest under QEMU's TCG.
    pub fn fastest() -> Self {
        match Self::Extract.is_tuned_here() {
            true => Self::Extract,
            false => Self::Shifts,
        }
    }

    /// Returns whether this CPU runs the loop's own instructions, rather than its portable version. The
    /// texels are the same.
    pub fn is_tuned_here(self) -> bool {
        match self {
            Self::Multiply => true,
            #[cfg(target_arch = "x86_64")]
            Self::Extract => cpu::has_extract(),
            _ => cfg!(target_arch = "x86_64"),
        }
    }

    /// Returns the stepper that the loop actually uses for `stepper`: it reads at these coordinates.
    ///
    /// Only [`Loop::Packed`] has fewer bits. It drops the last bit of v and of v's step. The step is cut
    /// towards zero, so the span stays as far inside the texture as before. After i pixels v is off by at
    /// most (i + 1) 2^-16 texel, so by n 2^-16 over a column of n pixels. That adds to the stepper's own
    /// n 2^-16; together they are the drift of 15 bits, n 2^-15. It is less than 0.0074 texel over 240
    /// pixels, and passes 1/256 texel after 128.
    pub fn effective(self, stepper: AffineStepper) -> AffineStepper {
        match self {
            Self::Packed => Halves::effective(stepper),
            _ => stepper,
        }
    }

    /// Draws a column.
    ///
    /// # Panics
    /// If the span leaves the texture, unless the loop wraps it around.
    #[inline]
    pub fn column(self, texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
        self.draw()(texture, &stepper, column);
    }

    /// Draws a column with the loop's portable version: the same registers and the same bits, on any CPU.
    ///
    /// # Panics
    /// As [`Loop::column`].
    pub fn portable(self, texture: &Texture<'_>, stepper: AffineStepper, column: Column<'_>) {
        self.draw_portably()(texture, &stepper, column);
    }

    /// Returns the function that draws a column on this CPU. Call this once for many columns.
    pub(crate) fn draw(self) -> Draw {
        #[cfg(target_arch = "x86_64")]
        match self {
            Self::TwoCarries => {
                return |texture, stepper, column| tuned::two_carries(texture, *stepper, column);
            }
            Self::Packed => {
                return |texture, stepper, column| tuned::packed(texture, *stepper, column);
            }
            Self::StepTable => {
                return |texture, stepper, column| tuned::step_table(texture, *stepper, column);
            }
            Self::Shifts => {
                return |texture, stepper, column| tuned::shifts(texture, *stepper, column);
            }
            Self::OneAccumulator => {
                return |texture, stepper, column| {
                    tuned::one_accumulator(texture, *stepper, column)
                };
            }
            Self::AddCarry => {
                return |texture, stepper, column| tuned::add_carry(texture, *stepper, column);
            }
            Self::Extract if cpu::has_extract() => {
                return |texture, stepper, column| tuned::extract(texture, *stepper, column);
            }
            Self::Extract | Self::Multiply => {}
        }
        self.draw_portably()
    }

    fn draw_portably(self) -> Draw {
        match self {
            Self::Multiply => registers::multiply,
            Self::TwoCarries | Self::StepTable => registers::column::<Address>,
            Self::Packed => registers::column::<Halves>,
            Self::Shifts => registers::column::<Pair>,
            Self::OneAccumulator | Self::Extract => registers::column::<Joint>,
            Self::AddCarry => registers::column::<Crossed>,
        }
    }
}

/// The functions that draw affine spans with a [`Loop`] on this CPU, looked up once for many spans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AffineLoops {
    /// Draws columns.
    pub column: Draw,
    /// Whether rows are drawn with the CPU's bit-extract.
    extract: bool,
}

impl AffineLoops {
    /// Returns the functions of `by`.
    pub fn new(by: Loop) -> Self {
        Self {
            column: by.draw(),
            extract: by == Loop::Extract && Loop::Extract.is_tuned_here(),
        }
    }

    /// Writes the texels of an affine span to `sink`. Along a row they are the same for every loop.
    #[inline(always)]
    pub fn fill(self, texture: &Texture<'_>, stepper: AffineStepper, sink: impl PixelSink) {
        sink.by_kind(
            |column| (self.column)(texture, &stepper, column),
            |sink| self.fill_row(texture, stepper, sink),
        );
    }

    #[inline(always)]
    fn fill_row(self, texture: &Texture<'_>, mut stepper: AffineStepper, sink: impl PixelSink) {
        let texels = texture.texels();
        match Joint::new(texture, stepper, 0) {
            #[cfg(target_arch = "x86_64")]
            Some(joint) if self.extract => tuned::fill_row(texels, joint, sink),
            Some(mut joint) => sink.fill(|| texels[joint.next()]),
            None => sink.fill(|| {
                let (u, v) = (stepper.u, stepper.v);
                stepper = stepper.every(1, 1);
                texture.at(u, v)
            }),
        }
    }
}
