//! The exact loops: several ways to compute the floor of a quotient for each pixel, with one result.
//!
//! A texel is the floor of a / c across and of b / c down, for the integers a, b and c of a
//! [`PlaneStepper`]. Every way computes exactly that floor, so the ways differ in time only:
//!
//! - [`Quotients::Divide`] divides integers: two unsigned divisions for each pixel. On x86-64 it is one
//!   loop of 17 instructions. It needs no floating point, so the kernel uses it.
//! - The other ways guess the quotients in `f64`, and divide integers only where a guess does not settle
//!   the floor: [`Quotients::Guess`] pixel by pixel, the others in groups, with vector instructions.
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
//! rounded to nearest, so each is off by a factor between 1 - e and 1 + e. Their product is off from the
//! quotient by a factor of less than 1 + 5 e, and the quotient is below 2^8, so the product is off by less
//! than 5 * 2^-45. Adding [`ALIGN`] then rounds it to a multiple of 2^-32, by at most 2^-33: in all, the sum
//! is off by less than 2^-32. The low 32 bits of the sum are the fraction, in units of 2^-32. So unless they
//! are all zeros or all ones, no whole number lies between the sum and the quotient, and the bits above them
//! are the quotient's floor. Otherwise the loop divides integers. A quotient is at least 0, so a sum below
//! zero is rounded to 0, whose fraction is all zeros.

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
    /// Guesses in `f64`, pixel by pixel.
    Guess,
    /// Guesses of four pixels at once, with AVX2.
    Avx2,
    /// Guesses of eight pixels at once, with AVX-512.
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
                unsafe { vectors::by_avx2(texture, span, column) }
            },
            #[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
            Self::Avx512 => |texture, span, column| {
                // SAFETY: `runs_here` found AVX-512 F, DQ and VL.
                unsafe { vectors::by_avx512(texture, span, column) }
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

/// Added to a number of magnitude below 2^9, it makes the lowest of the sum's 52 bits stand for 2^-32. 2^20
/// alone would let a negative number change the exponent.
#[cfg(not(target_os = "none"))]
const ALIGN: f64 = 1.5 * (1u64 << 20) as f64;

/// The bits of an aligned number's fraction plus one, of which none is set if the fraction was all zeros or
/// all ones.
#[cfg(not(target_os = "none"))]
const BETWEEN: i64 = 0xFFFF_FFFE;

/// What leads from a column and a row of a texture to a texel's index.
#[cfg(not(target_os = "none"))]
#[derive(Clone, Copy)]
struct Indexing {
    pitch: u32,
    wrap_column: u32,
    wrap_row: u32,
}

#[cfg(not(target_os = "none"))]
impl Indexing {
    fn new(texture: &Texture<'_>) -> Self {
        let (wrap_column, wrap_row) = texture.wrap();
        Self {
            pitch: texture.pitch().into(),
            wrap_column: wrap_column.into(),
            wrap_row: wrap_row.into(),
        }
    }

    #[inline(always)]
    fn index(self, column: u32, row: u32) -> u32 {
        (row & self.wrap_row) * self.pitch + (column & self.wrap_column)
    }

    /// Returns the index at a pixel of a span by integer division.
    #[inline(always)]
    fn divided(self, forms: [i64; 3]) -> u32 {
        let [a, b, c] = forms.map(|form| form as u64);
        let c = c.max(1);
        self.index((a / c) as u32, (b / c) as u32)
    }
}

/// Draws a column by guesses, pixel by pixel.
#[cfg(not(target_os = "none"))]
fn guess(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
    assert_eq!(column.len(), span.len, "a span fills its column");
    let index = Indexing::new(texture);
    let mut stepper = span.stepper;
    column.fill(|| {
        let forms = stepper.next();
        let [a, b, c] = forms.map(|form| form as f64);
        let over = 1.0 / c;
        let [u, v] = [a, b].map(|n| (n * over + ALIGN).to_bits());
        let is_between = |aligned: u64| aligned.wrapping_add(1) & BETWEEN as u64 != 0;
        let at = match is_between(u) && is_between(v) {
            true => index.index((u >> 32) as u32 & 0x1FF, (v >> 32) as u32 & 0x1FF),
            false => index.divided(forms),
        };
        // SAFETY: the index is that of the pixel's quotients, which are a column and a row of the texture.
        unsafe { *texture.texels().get_unchecked(at as usize) }
    });
}

/// The loops with vector instructions.
#[cfg(all(target_arch = "x86_64", not(target_os = "none")))]
mod vectors {
    use core::arch::x86_64::*;
    use core::array;

    use super::{ALIGN, BETWEEN, Column, Indexing, InsideSpan, PlaneStepper, Texture};

    /// Defines a function that draws a column in groups of `$lanes` pixels. `$load` makes a vector of
    /// integers and `$add` adds two. `$guess` returns a group's indices, four to a word because an index is
    /// below 2^16, and whether all guesses are exact.
    ///
    /// The last pixel of the span stands in for the pixels beyond it, so every lane is a pixel of the span.
    macro_rules! by_groups {
        ($name:ident, $features:literal, $lanes:literal, $load:expr, $add:ident, $guess:ident) => {
            #[target_feature(enable = $features)]
            pub(super) fn $name(texture: &Texture<'_>, span: InsideSpan, column: Column<'_>) {
                assert_eq!(column.len(), span.len, "a span fills its column");
                let index = Indexing::new(texture);
                let PlaneStepper { at, step } = span.stepper;
                let draw = |first: u16, guesses: ([u64; $lanes / 4], bool), pixels: Column<'_>| {
                    let (mut indices, exact) = guesses;
                    if !exact {
                        indices = settle(&span.stepper, first, pixels.len() - 1, index);
                    }
                    let mut pixel = 0;
                    pixels.fill(|| {
                        let index = (indices[pixel / 4] >> (pixel % 4 * 16)) as u16;
                        pixel += 1;
                        // SAFETY: the index is that of a pixel's quotients, which are a column and a row
                        // of the texture.
                        unsafe { *texture.texels().get_unchecked(usize::from(index)) }
                    });
                };
                let lanes = |k: usize, last: i64| {
                    let lane = |i: usize| at[k] + step[k] * (i as i64).min(last);
                    $load(array::from_fn(lane))
                };
                let stride = |k: usize| $load([step[k] * $lanes; $lanes]);
                let rest = span.len % $lanes;
                let mut first = 0;
                let (groups, last) = column.split(span.len - rest);
                if !groups.is_empty() {
                    let (mut a, mut b, mut c) = (lanes(0, 255), lanes(1, 255), lanes(2, 255));
                    let (a_step, b_step, c_step) = (stride(0), stride(1), stride(2));
                    for pixels in groups.chunks($lanes) {
                        draw(first, $guess(a, b, c, index), pixels);
                        (a, b, c) = ($add(a, a_step), $add(b, b_step), $add(c, c_step));
                        first += $lanes;
                    }
                }
                if rest > 0 {
                    let lanes = |k: usize| {
                        let lane = |i: usize| {
                            let pixel = i64::from(first) + (i as i64).min(i64::from(rest) - 1);
                            at[k] + step[k] * pixel
                        };
                        $load(array::from_fn(lane))
                    };
                    draw(first, $guess(lanes(0), lanes(1), lanes(2), index), last);
                }
            }
        };
    }

    by_groups!(
        by_avx512,
        "avx512f,avx512dq,avx512vl",
        8,
        load_512,
        _mm512_add_epi64,
        guess_512
    );
    by_groups!(by_avx2, "avx2", 4, load_256, _mm256_add_epi64, guess_256);

    /// Returns the indices of a group by integer division. Cold path: for a group in which a guess is near
    /// a whole number. The group has `last` pixels after its first pixel, which is pixel `first` of the
    /// span.
    #[cold]
    #[inline(never)]
    fn settle<const WORDS: usize>(
        stepper: &PlaneStepper,
        first: u16,
        last: u16,
        index: Indexing,
    ) -> [u64; WORDS] {
        let mut words = [0; WORDS];
        for pixel in 0..4 * WORDS as u16 {
            let forms = stepper.after(first + pixel.min(last));
            words[usize::from(pixel / 4)] |= u64::from(index.divided(forms)) << (pixel % 4 * 16);
        }
        words
    }

    #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
    #[inline]
    fn load_512(lanes: [i64; 8]) -> __m512i {
        let [a, b, c, d, e, f, g, h] = lanes;
        _mm512_setr_epi64(a, b, c, d, e, f, g, h)
    }

    #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
    #[inline]
    fn guess_512(a: __m512i, b: __m512i, c: __m512i, index: Indexing) -> ([u64; 2], bool) {
        let over = _mm512_div_pd(_mm512_set1_pd(1.0), _mm512_cvtepi64_pd(c));
        let align = _mm512_set1_pd(ALIGN);
        let u = _mm512_add_pd(_mm512_mul_pd(_mm512_cvtepi64_pd(a), over), align);
        let v = _mm512_add_pd(_mm512_mul_pd(_mm512_cvtepi64_pd(b), over), align);
        let (u, v) = (_mm512_castpd_si512(u), _mm512_castpd_si512(v));
        let (one, between) = (_mm512_set1_epi64(1), _mm512_set1_epi64(BETWEEN));
        let near = _mm512_testn_epi64_mask(_mm512_add_epi64(u, one), between)
            | _mm512_testn_epi64_mask(_mm512_add_epi64(v, one), between);
        let mask = |wrap: u32| _mm512_set1_epi64(i64::from(wrap & 0x1FF));
        let column = _mm512_and_si512(_mm512_srli_epi64::<32>(u), mask(index.wrap_column));
        let row = _mm512_and_si512(_mm512_srli_epi64::<32>(v), mask(index.wrap_row));
        let row = _mm512_mul_epu32(row, _mm512_set1_epi64(index.pitch.into()));
        let indices = _mm512_cvtepi64_epi16(_mm512_add_epi64(row, column));
        let words = [
            _mm_extract_epi64::<0>(indices),
            _mm_extract_epi64::<1>(indices),
        ];
        (words.map(|word| word as u64), near == 0)
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn load_256(lanes: [i64; 4]) -> __m256i {
        let [a, b, c, d] = lanes;
        _mm256_setr_epi64x(a, b, c, d)
    }

    /// Returns integers from 0 to below 2^63 as `f64`, rounded to nearest. The upper half gets the exponent
    /// of 2^84 and the lower half that of 2^52. The subtraction of both exponents' values from the upper
    /// half is exact, so only the last addition rounds.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn to_f64(n: __m256i) -> __m256d {
        const LOW: i64 = 0x4330_0000_0000_0000;
        const HIGH: i64 = 0x4530_0000_0000_0000;
        const BOTH: i64 = 0x4530_0000_0010_0000;
        let low = _mm256_blend_epi32::<0b1010_1010>(n, _mm256_set1_epi64x(LOW));
        let high = _mm256_or_si256(_mm256_srli_epi64::<32>(n), _mm256_set1_epi64x(HIGH));
        let both = _mm256_castsi256_pd(_mm256_set1_epi64x(BOTH));
        let high = _mm256_sub_pd(_mm256_castsi256_pd(high), both);
        _mm256_add_pd(high, _mm256_castsi256_pd(low))
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn guess_256(a: __m256i, b: __m256i, c: __m256i, index: Indexing) -> ([u64; 1], bool) {
        let over = _mm256_div_pd(_mm256_set1_pd(1.0), to_f64(c));
        let align = _mm256_set1_pd(ALIGN);
        let u = _mm256_castpd_si256(_mm256_add_pd(_mm256_mul_pd(to_f64(a), over), align));
        let v = _mm256_castpd_si256(_mm256_add_pd(_mm256_mul_pd(to_f64(b), over), align));
        let (one, between) = (_mm256_set1_epi64x(1), _mm256_set1_epi64x(BETWEEN));
        let is_near = |aligned| {
            let between = _mm256_and_si256(_mm256_add_epi64(aligned, one), between);
            _mm256_cmpeq_epi64(between, _mm256_setzero_si256())
        };
        let near = _mm256_or_si256(is_near(u), is_near(v));
        let mask = |wrap: u32| _mm256_set1_epi64x(i64::from(wrap & 0x1FF));
        let column = _mm256_and_si256(_mm256_srli_epi64::<32>(u), mask(index.wrap_column));
        let row = _mm256_and_si256(_mm256_srli_epi64::<32>(v), mask(index.wrap_row));
        let row = _mm256_mul_epu32(row, _mm256_set1_epi64x(index.pitch.into()));
        let indices = _mm256_add_epi64(row, column);
        // Indices 0 and 2 in one half, 1 and 3 in the other, 32 bits apart.
        let low = _mm256_castsi256_si128(indices);
        let high = _mm_slli_epi64::<32>(_mm256_extracti128_si256::<1>(indices));
        let pairs = _mm_or_si128(low, high);
        let first = _mm_extract_epi64::<0>(pairs) as u64;
        let second = _mm_extract_epi64::<1>(pairs) as u64;
        ([first | second << 16], _mm256_testz_si256(near, near) == 1)
    }
}
