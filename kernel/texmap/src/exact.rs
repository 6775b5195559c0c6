//! The exact perspective mapper: a quotient for every pixel, and no rounding but the floor.
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

use modex::Column;

use crate::Texture;
use crate::plane::{Walk, texel};

/// Draws a column of `len` pixels.
pub fn column(texture: &Texture<'_>, mut walk: Walk, len: u16, column: Column<'_>) {
    let texels = texture.texels();
    let (width, height) = (texture.width(), texture.height());
    let (w, h) = (i64::from(width), i64::from(height));
    let needs_no_clamp = |&row: &u16| {
        let [a, b, c] = walk.after(row);
        a >= 0 && b >= 0 && a < w * c && b < h * c
    };
    let first = (0..len).find(needs_no_clamp).unwrap_or(len);
    let last = (first..len).rev().find(needs_no_clamp);
    let end = last.map_or(first, |last| last + 1);

    let clamped = |[a, b, c]: [i64; 3]| {
        let (u, v) = (texel(a, c, width), texel(b, c, height));
        texels[usize::from(v) * usize::from(texture.pitch()) + usize::from(u)]
    };
    let (above, rest) = column.split(first);
    let (inside, below) = rest.split(end - first);
    above.fill(|| clamped(walk.next()));
    inside.fill(|| {
        let [a, b, c] = walk.next();
        texels[(b / c) as usize * usize::from(texture.pitch()) + (a / c) as usize]
    });
    below.fill(|| clamped(walk.next()));
}
