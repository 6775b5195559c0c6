//! The exact loops: several ways to compute the floor of a quotient for each pixel, with one result.
//!
//! A texel is the floor of a / c across and of b / c down, for the integers a, b and c of a
//! [`PlaneStepper`]. Every way computes exactly that floor, so the ways differ in time only:
//!
//! - [`Quotients::Divide`] divides integers: two unsigned divisions for each pixel. On x86-64 it is one
//!   loop of 17 instructions. It needs no floating point, so the kernel uses it.
//! - The other ways guess the quotients of [`GROUP`] pixels together in `f64`, and divide integers only
//!   where the guesses do not settle the floor. They differ in the instructions that the compiler may use:
//!   those of the CPU's baseline, AVX2 or AVX-512.
//!
//! # Range
//!
//! The loops draw an [`InsideSpan`]: at every pixel 0 <= a < w c and 0 <= b < h c, where w and h are the
//! texture's sides, at most 256. So c is above zero, both quotients are below 256, and an unsigned division
//! of the magnitudes is the signed division. a and b are below 2^61 and c is below 2^53 plus rounding, so
//! no sum overflows up to one step past the span's last pixel.
//!
//! # Why the guess is exact
//!
//! Let e = 2^-53. The conversions of a, b and c to `f64`, the reciprocal of c and the product are each
//! rounded to nearest, so each is off by a factor between 1 - e and 1 + e. Their product q is off from the
//! quotient by a factor of less than 1 + 5 e, and the quotient is below 2^8, so q is off by less than
//! 5 * 2^-45. Adding or subtracting [`MARGIN`], 2^-40, rounds by at most 2^-45 more. So the quotient lies
//! between q - 2^-40 and q + 2^-40 as computed. If both have the same whole part, the quotient has it too.
//! Otherwise the quotient lies near a whole number, and the loop divides integers. Conversion to an integer
//! cuts towards zero, which agrees with the floor because no quotient is negative: a q - 2^-40 below zero
//! counts as 0, and the quotient is at least 0.

#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
use core::arch::asm;
use core::ops::Range;

use modex::Column;
#[cfg(target_arch = "x86_64")]
use modex::STRIDE;

#[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
use super::cpu;
use super::sink::PixelSink;
use crate::geometry::Texture;
use crate::plane::PlaneStepper;

/// A way to compute exact quotients down a column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quotients {
    /// Integer divisions.
    #[default]
    Divide,
    /// Guesses in `f64`, with the instructions of the CPU's baseline.
    Guess,
    /// Guesses in `f64`, with AVX2.
    Avx2,
    /// Guesses in `f64`, with AVX-512.
    Avx512,
}

/// A function that draws the pixels of an [`InsideSpan`] down a column.
pub(crate) type DrawQuotients = fn(&Texture<'_>, InsideSpan, Column<'_>);

impl Quotients {
    /// All ways.
    pub const ALL: [Self; 4] = [Self::Divide, Self::Guess, Self::Avx2, Self::Avx512];

    /// Returns the fastest way on this machine. The bare machine has no floating point.
    pub fn fastest() -> Self {
        let mut ways = Self::ALL.into_iter().rev();
        ways.find(|way| way.runs_here()).unwrap_or(Self::Divide)
    }

    /// Returns whether this machine can run the way. A way that cannot run is replaced by
    /// [`Quotients::Divide`].
    pub fn runs_here(self) -> bool {
        match self {
            Self::Divide => true,
            Self::Guess => cfg!(not(target_os = "none")),
            #[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
            Self::Avx2 => cpu::has_avx2(),
            #[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
            Self::Avx512 => cpu::has_avx512(),
            #[cfg(not(all(target_arch = "x86_64", not(target_os = "none"))))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// Returns the function that draws a column in this way on this machine.
    pub(crate) fn draw(self) -> DrawQuotients {
        if !self.runs_here() {
            return divide;
        }
        match self {
            Self::Divide => divide,
            #[cfg(not(target_os = "none"))]
            Self::Guess => guess,
            #[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
            Self::Avx2 => |texture, span, column| {
                // SAFETY: `runs_here` found AVX2.
                unsafe { guess_with_avx2(texture, span, column) }
            },
            #[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
            Self::Avx512 => |texture, span, column| {
                // SAFETY: `runs_here` found AVX-512 F, DQ and VL.
                unsafe { guess_with_avx512(texture, span, column) }
            },
            #[cfg(not(all(target_arch = "x86_64", not(target_os = "none"))))]
            _ => divide,
        }
    }
}

/// The forms along a span whose pixels all lie inside the texture, tested at both ends.
///
/// With w and h the sides of the texture, a pixel lies inside when a >= 0, b >= 0, w c - a > 0 and
/// h c - b > 0; then c is above zero too. Each of the four is linear along the span, so if all hold at two
/// pixels, they hold at every pixel between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InsideSpan {
    stepper: PlaneStepper,
    len: u16,
}

impl InsideSpan {
    /// Returns the pixels of a span of `len` pixels that lie inside the texture, from the first to the last,
    /// with their number in the span. The range is empty if no pixel does; then no [`InsideSpan`] exists.
    #[inline]
    pub fn find(
        texture: &Texture<'_>,
        stepper: &PlaneStepper,
        len: u16,
    ) -> (Range<u16>, Option<Self>) {
        let [w, h] = [texture.width(), texture.height()].map(i64::from);
        let is_inside = |&pixel: &u16| {
            let [a, b, c] = stepper.after(pixel);
            a >= 0 && b >= 0 && a < w * c && b < h * c
        };
        let Some(first) = (0..len).find(is_inside) else {
            return (len..len, None);
        };
        let last = (first..len).rev().find(is_inside).unwrap_or(first);
        let at = stepper.after(first);
        let inside = Self {
            stepper: PlaneStepper { at, ..*stepper },
            len: last + 1 - first,
        };
        (first..last + 1, Some(inside))
    }

    /// Writes the texels to a sink that is no column.
    #[inline(always)]
    pub fn fill(mut self, texture: &Texture<'_>, sink: impl PixelSink) {
        sink.fill(|| divided(texture, self.stepper.next()));
    }
}

/// Returns the texel at a pixel inside the texture.
#[inline(always)]
fn divided(texture: &Texture<'_>, forms: [i64; 3]) -> u8 {
    let [a, b, c] = forms.map(|form| form as u64);
    // The form c of a pixel inside is above zero. `max` shows that to the compiler.
    let c = c.max(1);
    texture.texel((a / c) as usize, (b / c) as usize)
}

/// Draws a column with integer divisions, portably: the reference implementation.
fn divide_portably(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    span.fill(texture, column);
}

#[cfg(not(target_arch = "x86_64"))]
use divide_portably as divide;

/// Draws a column with integer divisions. The loop needs all registers, so it does not wrap: the portable
/// version draws tiled textures.
#[cfg(target_arch = "x86_64")]
fn divide(texture: &Texture<'_>, span: InsideSpan, mut column: Column<'_>) {
    assert_eq!(column.len(), span.len, "a span fills its column");
    if texture.tile().is_some() {
        return divide_portably(texture, span, column);
    }
    let PlaneStepper {
        at: [a, b, c],
        step: [a_step, b_step, c_step],
    } = span.stepper;
    // SAFETY: the code stores to the first byte of the column and to every 80th after it, as many bytes as
    // the column has pixels, at least one: exactly what `Lane::new` was promised. At each of these pixels
    // c is above zero, so no division traps, and the quotients are a column and a row of the texture, so
    // the texel that is read exists. The stack is not used.
    unsafe {
        asm!(
            "2:",
            "mov rax, {b}",
            "xor edx, edx",
            "div {c}",
            "mov {row}, rax",
            "mov rax, {a}",
            "xor edx, edx",
            "div {c}",
            "imul {row:e}, {pitch:e}",
            "add {row:e}, eax",
            "movzx eax, byte ptr [{texels} + {row}]",
            "mov byte ptr [{dest}], al",
            "add {a}, {a_step}",
            "add {b}, {b_step}",
            "add {c}, {c_step}",
            "add {dest}, {stride}",
            "dec {left:e}",
            "jnz 2b",
            a = inout(reg) a => _,
            b = inout(reg) b => _,
            c = inout(reg) c => _,
            a_step = in(reg) a_step,
            b_step = in(reg) b_step,
            c_step = in(reg) c_step,
            row = out(reg) _,
            texels = in(reg) texture.texels().as_ptr(),
            dest = inout(reg) column.as_ptr() => _,
            left = inout(reg) u32::from(span.len) => _,
            pitch = in(reg) u32::from(texture.pitch()),
            stride = const STRIDE,
            out("rax") _,
            out("rdx") _,
            options(nostack),
        );
    }
}

/// The error that a guess may have, in texels: see the [module](self).
#[cfg(not(target_os = "none"))]
const MARGIN: f64 = 1.0 / (1u64 << 40) as f64;

/// Pixels of a group. The compiler turns loops over a group into vector instructions.
#[cfg(not(target_os = "none"))]
const GROUP: usize = 16;

/// Below this number of pixels at a span's end, dividing costs less than a group.
#[cfg(not(target_os = "none"))]
const LEAST: u16 = 4;

/// The changes of a, b and c from a group's first pixel to each of its pixels.
#[cfg(not(target_os = "none"))]
struct Offsets([[u64; GROUP]; 3]);

#[cfg(not(target_os = "none"))]
impl Offsets {
    /// Returns the offsets of a group with `pixels` pixels, at least one. The last pixel stands in for the
    /// pixels beyond it, so that every number in the group is that of a pixel in the span.
    #[inline(always)]
    fn new(step: [i64; 3], pixels: u16) -> Self {
        let mut offsets = [[0; GROUP]; 3];
        for (offsets, step) in offsets.iter_mut().zip(step) {
            for (offset, pixel) in offsets.iter_mut().zip(0..) {
                *offset = i64::min(pixel, i64::from(pixels) - 1).wrapping_mul(step) as u64;
            }
        }
        Self(offsets)
    }

    /// Returns the texels' indices in a group whose first pixel has these forms.
    #[inline(always)]
    fn indices(&self, texture: &Texture<'_>, at: [i64; 3]) -> [u32; GROUP] {
        let [a, b, c] = at.map(|form| form as u64);
        let Self([a_offsets, b_offsets, c_offsets]) = self;
        let (wrap_column, wrap_row) = texture.wrap();
        let pitch = u32::from(texture.pitch());
        let mut indices = [0; GROUP];
        let mut differ = 0;
        for i in 0..GROUP {
            let over = 1.0 / c.wrapping_add(c_offsets[i]) as f64;
            let u = a.wrapping_add(a_offsets[i]) as f64 * over;
            let v = b.wrapping_add(b_offsets[i]) as f64 * over;
            let whole = |guess: f64| {
                // SAFETY: a quotient is 0 to 256, and a guess with its margin is off by less than one.
                unsafe { guess.to_int_unchecked::<i32>() as u32 }
            };
            let (column, row) = (whole(u - MARGIN), whole(v - MARGIN));
            differ |= (column ^ whole(u + MARGIN)) | (row ^ whole(v + MARGIN));
            indices[i] = (row & u32::from(wrap_row)) * pitch + (column & u32::from(wrap_column));
        }
        match differ {
            0 => indices,
            _ => self.divided(texture, at),
        }
    }

    /// Returns the same indices by integer division. Cold path: for a group in which a guess is near a
    /// whole number.
    #[cold]
    #[inline(never)]
    fn divided(&self, texture: &Texture<'_>, at: [i64; 3]) -> [u32; GROUP] {
        core::array::from_fn(|i| {
            let form = |k: usize| (at[k] as u64).wrapping_add(self.0[k][i]);
            let [column, row] = [0, 1].map(|k| (form(k) / form(2).max(1)) as usize);
            texture.index(column, row) as u32
        })
    }
}

/// Draws a column by guesses. This is compiled once for each set of instructions.
#[cfg(not(target_os = "none"))]
#[inline(always)]
fn guess_by_groups(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    assert_eq!(column.len(), span.len, "a span fills its column");
    let step = span.stepper.step;
    let rest = span.len % GROUP as u16;
    let (groups, last) = column.split(span.len - rest);
    let write = |pixels: Column<'_>, indices: [u32; GROUP]| {
        let mut indices = indices.iter();
        pixels.fill(|| {
            let index = indices.next().map_or(0, |&index| index as usize);
            // SAFETY: the index is that of a pixel's quotients, which are a column and a row of the texture.
            unsafe { *texture.texels().get_unchecked(index) }
        });
    };
    let mut at = span.stepper.at;
    if !groups.is_empty() {
        let offsets = Offsets::new(step, GROUP as u16);
        for pixels in groups.chunks(GROUP as u16) {
            write(pixels, offsets.indices(texture, at));
            for (form, step) in at.iter_mut().zip(step) {
                *form = form.wrapping_add(step.wrapping_mul(GROUP as i64));
            }
        }
    }
    if rest >= LEAST {
        write(last, Offsets::new(step, rest).indices(texture, at));
    } else {
        let mut stepper = PlaneStepper { at, step };
        last.fill(|| divided(texture, stepper.next()));
    }
}

#[cfg(not(target_os = "none"))]
fn guess(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    guess_by_groups(texture, span, column);
}

#[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
#[target_feature(enable = "avx2")]
fn guess_with_avx2(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    guess_by_groups(texture, span, column);
}

#[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn guess_with_avx512(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    guess_by_groups(texture, span, column);
}
