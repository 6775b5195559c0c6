//! The exact perspective mapper: the texel of the quotient at every pixel, with no rounding but the floor.
//!
//! Legal input: a plane as [`Plane::new`] makes it, and a span on the screen. Error: zero against the
//! quantised forms; [`crate::plane`] bounds the effect of quantising them.
//!
//! The pixels inside the texture are consecutive, and [`Quotients`] draws them without a clamp. Only the
//! pixels before and after them are clamped.
//!
//! [`Plane::new`]: crate::Plane::new
//! [`Quotients`]: crate::Quotients

use modex::Column;

use crate::geometry::Texture;
use crate::loops::{DrawQuotients, InsideSpan, PixelSink, Quotients, SpanPixels};
use crate::plane::{self, PlaneStepper};

/// Writes the texels of the `len` pixels from pixel `first` of `pixels` on. `draw` draws columns.
#[inline(always)]
pub(crate) fn fill(
    texture: &Texture<'_>,
    mut stepper: PlaneStepper,
    draw: DrawQuotients,
    pixels: &mut impl SpanPixels,
    first: u16,
    len: u16,
) {
    let (inside, span) = InsideSpan::find(texture, &stepper, len);
    let before = inside.start;
    if before > 0 {
        let sink = pixels.part(first, before);
        sink.fill(|| texel(texture, stepper.next()));
    }
    let Some(span) = span else {
        return;
    };
    let count = inside.end - before;
    pixels.part(first + before, count).by_kind(
        |column| draw(texture, span, column),
        |sink| span.fill(texture, sink),
    );
    if inside.end < len {
        stepper.at = stepper.after(count);
        let sink = pixels.part(first + inside.end, len - inside.end);
        sink.fill(|| texel(texture, stepper.next()));
    }
}

/// Draws a column by `quotients`.
pub fn column(
    texture: &Texture<'_>,
    stepper: PlaneStepper,
    quotients: Quotients,
    column: Column<'_>,
) {
    self::draw(texture, stepper, quotients.draw(), column);
}

/// Draws a column by a function that was looked up before.
#[inline(never)]
pub(crate) fn draw(
    texture: &Texture<'_>,
    stepper: PlaneStepper,
    draw: DrawQuotients,
    mut column: Column<'_>,
) {
    let len = column.len();
    fill(texture, stepper, draw, &mut column, 0, len);
}

/// Returns the texel at any pixel.
#[inline]
fn texel(texture: &Texture<'_>, [a, b, c]: [i64; 3]) -> u8 {
    let u = plane::texel(a, c, texture.width());
    let v = plane::texel(b, c, texture.height());
    texture.texel(u.into(), v.into())
}
