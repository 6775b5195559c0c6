//! The exact perspective mapper: the texel of the quotient at every pixel, with no rounding but the floor.
//!
//! Legal input: a plane as [`Plane::new`] makes it, and a column on the screen. Error: zero against the
//! quantised forms; [`crate::plane`] bounds the effect of quantising them.
//!
//! # Why the loop does not clamp
//!
//! With w and h the width and height of the texture, a pixel needs no clamp when a >= 0, b >= 0, w c - a > 0
//! and h c - b > 0; then c is above zero too. Each of the four is linear down the column, so if all hold at
//! two pixels, they hold at every pixel between. So the loop searches from the top and from the bottom for
//! the first pixel that needs no clamp, and clamps only the pixels outside these two.
//!
//! # Why most pixels are not divided
//!
//! Where the coordinates curve little enough, the loop first makes a linear estimate, with a margin from
//! [`crate::plane::bounds`] that its error never exceeds. If the estimate minus the margin and the estimate
//! plus the margin have the same floor, the quotient between them has it too, and that floor *is* the texel.
//! Otherwise the estimate lies within the margin of a texel's border, and the loop divides. With the largest
//! margin, `MARGIN`, it divides at most one pixel in 8 if the texture coordinates are spread evenly.
//!
//! [`Plane::new`]: crate::Plane::new

use modex::Column;

use super::pieces::Cuts;
use crate::geometry::Texture;
use crate::loops::PixelSink;
use crate::plane::bounds::SpanBound;
use crate::plane::{self, PlaneStepper, Subdivision};

/// The largest useful margin of an estimate, in units of 2^-16 texel.
const MARGIN: u32 = 2048;
/// Steps of the shortest pieces that are worthwhile.
const SHORTEST: u8 = 16;
/// Below this number of pixels, dividing costs less than making the estimate.
const LEAST: u16 = 24;

/// Writes the texels of the quotients to `sink`.
#[inline(always)]
pub(crate) fn fill(texture: &Texture<'_>, stepper: PlaneStepper, sink: impl PixelSink) {
    sink.by_kind(
        |column| self::column(texture, stepper, column.len(), column),
        |sink| {
            let mut stepper = stepper;
            sink.fill(|| texel(texture, stepper.next()));
        },
    );
}

/// Draws a column of `len` pixels.
#[inline(never)]
pub fn column(texture: &Texture<'_>, mut stepper: PlaneStepper, len: u16, column: Column<'_>) {
    let (width, height) = (texture.width(), texture.height());
    let (w, h) = (i64::from(width), i64::from(height));
    let needs_no_clamp = |&row: &u16| {
        let [a, b, c] = stepper.after(row);
        a >= 0 && b >= 0 && a < w * c && b < h * c
    };
    let first = (0..len).find(needs_no_clamp).unwrap_or(len);
    let last = (first..len).rev().find(needs_no_clamp);
    let end = last.map_or(first, |last| last + 1);

    let (above, rest) = column.split(first);
    let (inside, below) = rest.split(end - first);
    above.fill(|| texel(texture, stepper.next()));
    let pixels = inside.len();
    match estimate(texture, &stepper, pixels) {
        Some((pieces, margin)) => estimated(texture, stepper, pieces, margin, inside),
        None => divided(texture, stepper, inside),
    }
    stepper.at = stepper.after(pixels);
    below.fill(|| texel(texture, stepper.next()));
}

/// Returns the texel at any pixel.
#[inline]
pub(crate) fn texel(texture: &Texture<'_>, [a, b, c]: [i64; 3]) -> u8 {
    let u = plane::texel(a, c, texture.width());
    let v = plane::texel(b, c, texture.height());
    texture.texel(u.into(), v.into())
}

/// Returns the texel at a pixel that needs no clamp.
#[inline(always)]
fn quotient(texture: &Texture<'_>, [a, b, c]: [i64; 3]) -> u8 {
    texture.texel((a / c) as usize, (b / c) as usize)
}

/// Divides at every pixel.
fn divided(texture: &Texture<'_>, mut stepper: PlaneStepper, column: Column<'_>) {
    column.fill(|| quotient(texture, stepper.next()));
}

/// Returns the longest pieces whose linear estimate is good enough, and the estimate's margin; nothing if no
/// pieces are.
fn estimate(texture: &Texture<'_>, stepper: &PlaneStepper, len: u16) -> Option<(Subdivision, i32)> {
    if len < LEAST {
        return None;
    }
    let bound = SpanBound::new(stepper, len, texture);
    let steps = u64::from(bound.steps());
    if bound.chord_at_least() * u64::from(SHORTEST).pow(2) > u64::from(MARGIN) * steps * steps {
        return None;
    }
    let pieces = [
        Subdivision::Whole,
        Subdivision::Of(64),
        Subdivision::Of(32),
        Subdivision::Of(SHORTEST),
    ]
    .into_iter();
    let mut margins = pieces.map(|pieces| (pieces, bound.linear(pieces)));
    let (pieces, margin) = margins.find(|&(_, margin)| margin <= MARGIN)?;
    Some((pieces, margin as i32))
}

/// Divides where the estimate leaves two texels to choose from.
fn estimated(
    texture: &Texture<'_>,
    stepper: PlaneStepper,
    pieces: Subdivision,
    margin: i32,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(stepper, column.len(), pieces, texture);
    let mut i = 0;
    while !column.is_empty() {
        let piece = cuts.next();
        let (pixels, rest) = column.split(piece.pixels);
        let mut estimate = piece.stepper();
        estimate.u -= margin;
        estimate.v -= margin;
        pixels.fill(|| {
            let (u, v) = (estimate.u, estimate.v);
            estimate = estimate.every(1, 1);
            let (u_most, v_most) = (u + 2 * margin, v + 2 * margin);
            let at = i;
            i += 1;
            // The whole parts differ.
            if (((u ^ u_most) | (v ^ v_most)) as u32) >> 16 != 0 {
                return quotient(texture, stepper.after(at));
            }
            texture.at(u_most, v_most)
        });
        column = rest;
    }
}
