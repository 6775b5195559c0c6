//! The exact perspective mapper: the quotient's texel at every pixel, and no rounding but the
//! floor.
//!
//! Legal input: a plane as [`Plane::new`] makes it, a column on the screen. Error: none against the
//! quantised forms; what quantising them does is bounded in [`crate::plane`].
//!
//! # Why the loop does not clamp
//!
//! A pixel needs no clamp when a, b, w c - a and h c - b are at least zero, the last two above it
//! (then c is, too). Each of them is linear down the column; where all hold at two pixels they hold
//! at every pixel between. So the ends are taken off, pixel by pixel, until one is found from above
//! and one from below that need none, and only the ends are clamped.
//!
//! # Why most pixels are not divided
//!
//! Where the column bends little enough a linear estimate comes first, and a margin that
//! [`crate::bounds`] says it is never off by. If the estimate less the margin and the estimate and
//! the margin have the same floor, so has the quotient between them: that *is* the texel. Only
//! where they have not, which is within the margin of a texel's border, the pixel is divided. At
//! `MARGIN` that is one in 8 at most, where the texture is passed evenly.
//!
//! [`Plane::new`]: crate::Plane::new

use modex::Column;

use crate::Texture;
use crate::bounds::Bend;
use crate::plane::{self, Walk};
use crate::runs::{Cuts, Pieces};

/// The most that an estimate may be off, in 2^-16 texel.
const MARGIN: u32 = 2048;
/// Steps of the shortest pieces that are worth it.
const SHORTEST: u8 = 16;
/// Below so many pixels dividing takes less than finding out.
const LEAST: u16 = 24;

/// Draws a column of `len` pixels.
#[inline(never)]
pub fn column(texture: &Texture<'_>, mut walk: Walk, len: u16, column: Column<'_>) {
    let (width, height) = (texture.width(), texture.height());
    let (w, h) = (i64::from(width), i64::from(height));
    let needs_no_clamp = |&row: &u16| {
        let [a, b, c] = walk.after(row);
        a >= 0 && b >= 0 && a < w * c && b < h * c
    };
    let first = (0..len).find(needs_no_clamp).unwrap_or(len);
    let last = (first..len).rev().find(needs_no_clamp);
    let end = last.map_or(first, |last| last + 1);

    let (above, rest) = column.split(first);
    let (inside, below) = rest.split(end - first);
    above.fill(|| texel(texture, walk.next()));
    let pixels = inside.len();
    match estimate(texture, &walk, pixels) {
        Some((pieces, margin)) => estimated(texture, walk, pieces, margin, inside),
        None => divided(texture, walk, inside),
    }
    walk.at = walk.after(pixels);
    below.fill(|| texel(texture, walk.next()));
}

/// The texel at any pixel.
#[inline]
pub(crate) fn texel(texture: &Texture<'_>, [a, b, c]: [i64; 3]) -> u8 {
    let u = plane::texel(a, c, texture.width());
    let v = plane::texel(b, c, texture.height());
    texture.texel(u.into(), v.into())
}

/// The texel at a pixel that needs no clamp.
#[inline(always)]
fn quotient(texture: &Texture<'_>, [a, b, c]: [i64; 3]) -> u8 {
    texture.texel((a / c) as usize, (b / c) as usize)
}

/// Divides at every pixel.
fn divided(texture: &Texture<'_>, mut walk: Walk, column: Column<'_>) {
    column.fill(|| quotient(texture, walk.next()));
}

/// The longest pieces whose linear estimate is good enough, and what it is off by at most.
fn estimate(texture: &Texture<'_>, walk: &Walk, len: u16) -> Option<(Pieces, i32)> {
    if len < LEAST {
        return None;
    }
    let bend = Bend::new(walk, len, texture);
    let steps = u64::from(bend.steps());
    if bend.chord_at_least() * u64::from(SHORTEST).pow(2) > u64::from(MARGIN) * steps * steps {
        return None;
    }
    let pieces = [
        Pieces::Whole,
        Pieces::Of(64),
        Pieces::Of(32),
        Pieces::Of(SHORTEST),
    ]
    .into_iter();
    let mut margins = pieces.map(|pieces| (pieces, bend.linear(pieces)));
    let (pieces, margin) = margins.find(|&(_, margin)| margin <= MARGIN)?;
    Some((pieces, margin as i32))
}

/// Divides where the estimate leaves two texels to choose from.
fn estimated(
    texture: &Texture<'_>,
    walk: Walk,
    pieces: Pieces,
    margin: i32,
    mut column: Column<'_>,
) {
    let mut cuts = Cuts::new(walk, column.len(), pieces, texture);
    let mut i = 0;
    while !column.is_empty() {
        let piece = cuts.next();
        let (pixels, rest) = column.split(piece.pixels());
        let mut estimate = piece.straight();
        estimate.u -= margin;
        estimate.v -= margin;
        pixels.fill(|| {
            let (u, v) = (estimate.u, estimate.v);
            estimate = estimate.every(1, 1);
            let (u_most, v_most) = (u + 2 * margin, v + 2 * margin);
            let at = i;
            i += 1;
            // The bits above the fractions differ.
            if (((u ^ u_most) | (v ^ v_most)) as u32) >> 16 != 0 {
                return quotient(texture, walk.after(at));
            }
            texture.at(u_most, v_most)
        });
        column = rest;
    }
}
