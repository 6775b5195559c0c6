//! Linear pieces: perspective with constant steps between exact quotients.
//!
//! The step is cut towards zero. So nothing between two ends inside the texture lies outside it, and no loop
//! clamps. After n pixels the cut step is off by less than n 2^-16 texel.

use core::hint::black_box;

use modex::Column;

use super::mapped_span::{MappedSpan, SpanKind, map_plane};
use super::pieces::{Cuts, between};
use crate::geometry::{Axis, Dropped, Texture};
use crate::loops::{AffineStepper, Draw, Loop};
#[cfg(target_arch = "x86_64")]
use crate::loops::{extract_eights, shifts_eights};
use crate::plane::{Face, LONGEST_POWER, LargeReciprocal, PlaneStepper, Reciprocal, Subdivision};

/// Passes the spans of a face to `sink`, in pieces of 16 pixels along columns or rows, whichever direction
/// changes the depth less.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map_row_or_column(
    face: &Face<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let plane = face.plane();
    let axis = match plane.c.right.abs() < plane.c.down.abs() {
        true => Axis::Right,
        false => Axis::Down,
    };
    map_plane(
        axis,
        face,
        |stepper| SpanKind::Linear(stepper, Subdivision::Of(16)),
        sink,
    )
}

/// A function that draws a column in linear pieces, each with a [`Draw`].
pub(crate) type DrawLinear = fn(&Texture<'_>, &PlaneStepper, Subdivision, Draw, Column<'_>);

/// Returns the function that draws a column in linear pieces on this CPU, for the loop `by`. The fastest
/// loops for padded textures draw the pieces in place; the others use the [`Draw`].
pub(crate) fn drawing(by: Loop) -> DrawLinear {
    #[cfg(target_arch = "x86_64")]
    match by {
        Loop::Shifts => {
            return |texture, stepper, pieces, draw_piece, column| {
                draw(texture, stepper, pieces, draw_piece, shifts_eights, column);
            };
        }
        Loop::Extract if by.is_tuned_here() => {
            return |texture, stepper, pieces, draw_piece, column| {
                draw(texture, stepper, pieces, draw_piece, extract_eights, column);
            };
        }
        _ => {}
    }
    |texture, stepper, pieces, draw_piece, column| {
        let inline = |texture: &Texture<'_>, stepper, pixels: Column<'_>| {
            draw_piece(texture, &stepper, pixels)
        };
        draw(texture, stepper, pieces, draw_piece, inline, column);
    }
}

/// Draws a column that is linear in each piece. `draw_piece` draws a piece. `draw_eights` draws pieces whose
/// pixels come in whole eights, where there are enough pieces to make it worthwhile.
#[inline(always)]
fn draw(
    texture: &Texture<'_>,
    stepper: &PlaneStepper,
    pieces: Subdivision,
    draw_piece: Draw,
    draw_eights: impl Fn(&Texture<'_>, AffineStepper, Column<'_>),
    mut column: Column<'_>,
) {
    let (last, mut left) = (texture.last(), column.len() - 1);
    // If both ends of the span are inside the texture and in front of the eye, everything between them is
    // too.
    let [width, height] = [last.0, last.1].map(|last| i64::from(last >> 16) + 1);
    let needs_no_clamp = |[a, b, c]: [i64; 3]| a >= 0 && b >= 0 && a < width * c && b < height * c;
    if !(needs_no_clamp(stepper.at) && needs_no_clamp(stepper.after(left))) {
        return draw_clamped(texture, stepper, pieces, draw_piece, column);
    }
    let quotients = |[a, b, c]: [i64; 3]| {
        let over = Reciprocal::new(c);
        (over.times(a), over.times(b))
    };
    let mut at = stepper.at;
    let mut here = quotients(at);
    let alike = match pieces {
        Subdivision::Of(steps) => u16::from(steps),
        Subdivision::Powers => LONGEST_POWER,
        Subdivision::Whole => 0,
    };
    // Pieces of equally many steps, a power of two. The last piece has one pixel more, so it is not among
    // them.
    if left > alike
        && alike >= 8
        && alike.is_power_of_two()
        && at[2].min(stepper.after(left + alike)[2]) >= LargeReciprocal::LEAST
        // Checked once here, so that no loop has to.
        && texture.masks().is_some()
    {
        let bits = alike.trailing_zeros();
        let all = (left - 1) >> bits << bits;
        let (pixels, rest) = column.split(all);
        let stride = stepper.step.map(|step| step << bits);
        let cut = |delta: i32| {
            let up = if delta < 0 { i32::from(alike) - 1 } else { 0 };
            (delta + up) >> bits
        };
        let [mut a, mut b, mut c] = [at[0], at[1], at[2] + stride[2]];
        // Hide the division from the compiler, which would otherwise move each division to the place of its
        // use.
        let mut over = black_box(LargeReciprocal::new(c));
        for pixels in pixels.chunks(alike) {
            a += stride[0];
            b += stride[1];
            c += stride[2];
            let ((u, v), to) = (here, (over.times(a), over.times(b)));
            // The division for the next piece runs while this piece is drawn.
            over = LargeReciprocal::new(c);
            let (du, dv) = (cut(to.0 - u), cut(to.1 - v));
            draw_eights(texture, AffineStepper { u, v, du, dv }, pixels);
            here = to;
        }
        at = [a, b, c - stride[2]];
        left -= all;
        column = rest;
    }
    while !column.is_empty() {
        let steps = pieces.longest(left);
        left -= steps;
        at = [0, 1, 2].map(|k| at[k] + stepper.step[k] * i64::from(steps));
        let to = quotients(at);
        let (pixels, rest) = column.split(steps + u16::from(left == 0));
        draw_piece(texture, &between(here, to, steps), pixels);
        (here, column) = (to, rest);
    }
}

/// Draws a column as [`draw`] does, where quotients may have to be clamped into the texture.
#[cold]
fn draw_clamped(
    texture: &Texture<'_>,
    stepper: &PlaneStepper,
    pieces: Subdivision,
    draw_piece: Draw,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(*stepper, column.len(), pieces, texture);
    while !column.is_empty() {
        let piece = cuts.next();
        let (pixels, rest) = column.split(piece.pixels);
        draw_piece(texture, &piece.stepper(), pixels);
        column = rest;
    }
}
