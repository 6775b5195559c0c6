//! The affine column mapper: texture coordinates stepped down the column in 16.16.
//!
//! [`Sides`] has the coordinates along a polygon's sides, and makes the stepper of a span: between the two
//! crossings, or by chapter 57's half steps. In a triangle the coordinates are one affine map of the screen.
//! Where that map is within its legal range, [`AffineMap`] holds it and makes steppers at a fraction of the
//! cost.
//!
//! Error against the exact affine coordinates: below 1/128 texel, by [`Sides::stepper`] and by [`AffineMap`].
//! Most of it is the step, which is cut to 2^-16 texel towards zero: after n pixels the coordinate is off by
//! less than n 2^-16 texel. The half steps follow a different rule: see [`Sides::half_step`].

use modex::{HEIGHT, WIDTH};

use super::mapped_span::{MappedSpan, SpanKind};
use crate::geometry::{Axis, Dropped, MAX_SIDES, Texture, Vertex, check};
use crate::loops::{AffineStepper, Loop};
use crate::plane::Face;
use crate::scan::{EdgeInterpolant, Span, crossed, offset, spans, spans_and_crossings};

/// The texture coordinates along a side of the polygon.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    u: EdgeInterpolant,
    v: EdgeInterpolant,
    /// The side's two vertices, in the order of the lines.
    vertices: [Vertex; 2],
}

impl Side {
    /// Returns the side between `a` and `b`, given in either order, at the lines that go along `axis`. A side
    /// that crosses no line gets a default value, which nothing reads.
    fn new(a: &Vertex, b: &Vertex, axis: Axis) -> Self {
        let lines = match axis {
            Axis::Down => WIDTH,
            Axis::Right => HEIGHT,
        };
        // Step forward always, so that neighbours step along a shared edge with the same bits.
        let (a, b) = if place(a, axis).0 <= place(b, axis).0 {
            (a, b)
        } else {
            (b, a)
        };
        let (from, to) = (place(a, axis).0, place(b, axis).0);
        let Some((first, _)) = crossed(from, to, lines as i32) else {
            return Self::default();
        };
        let length = i64::from(to) - i64::from(from);
        let offset = i64::from(offset(first, from));
        let interpolant =
            |a: i32, b: i32| EdgeInterpolant::new(a, i64::from(b - a), length, first, offset, 16);
        Self {
            u: interpolant(a.u, b.u),
            v: interpolant(a.v, b.v),
            vertices: [*a, *b],
        }
    }
}

/// Returns a vertex's position across the lines that go along `axis`, and its position along them.
fn place(vertex: &Vertex, axis: Axis) -> (i32, i32) {
    match axis {
        Axis::Down => (vertex.x, vertex.y),
        Axis::Right => (vertex.y, vertex.x),
    }
}

/// Least distance between two crossings for which [`Sides::stepper`] interpolates between them: 1/128 pixel,
/// 24 fraction bits.
const LEAST_HEIGHT: i64 = 1 << 17;

/// The texture coordinates along all sides of a polygon.
#[derive(Debug)]
pub struct Sides {
    axis: Axis,
    sides: [Side; MAX_SIDES],
    /// The last coordinate inside the texture, across and down.
    last: (i32, i32),
}

impl Sides {
    /// Returns the coordinates along the sides of `polygon` in `texture`, at the lines that go along `axis`.
    ///
    /// # Errors
    /// If the polygon is outside the legal range, or its coordinates are outside the texture.
    pub fn new(polygon: &[Vertex], texture: &Texture<'_>, axis: Axis) -> Result<Self, Dropped> {
        check(polygon)?;
        let (width, height) = (texture.width(), texture.height());
        let inside = |vertex: &Vertex| {
            (0..=i32::from(width) << 16).contains(&vertex.u)
                && (0..=i32::from(height) << 16).contains(&vertex.v)
        };
        if !polygon.iter().all(inside) {
            return Err(Dropped::OutOfRange);
        }
        let mut sides = [Side::default(); MAX_SIDES];
        for (i, a) in polygon.iter().enumerate() {
            sides[i] = Side::new(a, &polygon[(i + 1) % polygon.len()], axis);
        }
        Ok(Self {
            axis,
            sides,
            last: texture.last(),
        })
    }

    /// Returns the stepper along a span of [`spans_and_crossings`] on the same axis.
    ///
    /// The coordinates at the centres of the first and the last pixel are interpolated between the two
    /// crossings, then clamped into the texture. The step between them is cut towards zero.
    ///
    /// Error against the exact interpolation along the sides to the line's centre, and then along the line:
    /// below 1/128 texel, and for a span of n pixels, n at least 2, below n + 4 units of 2^-16 texel.
    /// Proof: let h be the height, which is the distance between the crossings. A crossing is known to
    /// 320 2^-32 pixel, and is then cut to 2^-24 pixel. These errors move the pixel's share of the height by
    /// less than (320 2^-32 + 2^-24) / h. Along the height the coordinate changes by at most 256 texels, so
    /// it moves by less than 2.3 / h units. The ends' coordinates, the quotient and the coordinate itself are
    /// rounded: less than 1.2 units together. In a span of two pixels or more, h is at least 1, and the steps
    /// lose less than n - 1 units. A single pixel has no step: if h is at least 1/128, its error is below 296
    /// units, and 1/128 texel is 512 units. If h is smaller, the coordinates are computed exactly.
    ///
    /// The bound holds where two sides cross the line, as in every convex polygon. Where four or more sides
    /// cross it, and two of them within 2^-23 pixel of each other in one cell, the scan may confuse these two
    /// as ends of spans.
    pub fn stepper(&self, span: &Span) -> AffineStepper {
        let [top, bottom] = span.ends;
        // A height below 2^9 pixels has at most 33 bits, and its product with a difference of coordinates
        // (28 bits, 20 of them fraction) fits 64. Taller heights are scaled down.
        let mut height = (bottom.at - top.at) >> 8;
        if height < LEAST_HEIGHT {
            return self.exact(span);
        }
        let offset = |row: i64| (((row << 32) + (1 << 31)) - top.at) >> 8;
        let (first, len) = (i64::from(span.first), i64::from(span.len));
        let (mut start, mut stop) = (offset(first), offset(first + len - 1));
        let excess = (64 - height.max(1).leading_zeros()).saturating_sub(34);
        for length in [&mut height, &mut start, &mut stop] {
            *length >>= excess;
        }
        let at = |coordinate: fn(&Side) -> &EdgeInterpolant, offset: i64, last: i32| {
            let [from, to] = self.ends(span, coordinate).map(|end| end >> 12);
            let part = (to - from) * offset.clamp(0, height) / height;
            (((from + part) >> 4) as i32).clamp(0, last)
        };
        let (u, v) = (
            at(|s| &s.u, start, self.last.0),
            at(|s| &s.v, start, self.last.1),
        );
        let (mut du, mut dv) = (0, 0);
        // A span of one pixel has no step; len - 1 would divide by zero.
        if span.len > 1 {
            let steps = i32::from(span.len) - 1;
            du = (at(|s| &s.u, stop, self.last.0) - u) / steps;
            dv = (at(|s| &s.v, stop, self.last.1) - v) / steps;
        }
        AffineStepper { u, v, du, dv }
    }

    /// Returns the stepper of a span of one pixel, with the exact coordinates at its centre, rounded down.
    /// Where the two crossings coincide, the coordinates are those on the first side.
    ///
    /// Cold path: only slivers have crossings this close.
    #[cold]
    #[inline(never)]
    fn exact(&self, span: &Span) -> AffineStepper {
        let centre = |cell: u16| i64::from(cell) * 256 + 128;
        let (line, pixel) = (centre(span.line), centre(span.first));
        // The line lies `before` past a side's first vertex and `after` before the second; their sum, the
        // side's length across the lines, is 1 to 2^24. On the side, a quantity that is f and g at the
        // vertices is (f after + g before) / length.
        let [top, bottom] = span.ends.map(|end| {
            let side = &self.sides[end.side].vertices;
            let [(p0, q0), (p1, q1)] = side.each_ref().map(|vertex| place(vertex, self.axis));
            let (before, after) = (line - i64::from(p0), i64::from(p1) - line);
            let times = |f: i64, g: i64| i128::from(f * after + g * before);
            let [u, v]: [fn(&Vertex) -> i32; 2] = [|vertex| vertex.u, |vertex| vertex.v];
            let coordinates = [u, v].map(|of| times(of(&side[0]).into(), of(&side[1]).into()));
            // From the pixel down to the crossing, times the length: below 2^48, as the coordinates are.
            let down = times(i64::from(q0) - pixel, i64::from(q1) - pixel);
            (i128::from(before + after), coordinates, down)
        });
        // The crossings' distances from the pixel, each times both lengths, weigh the coordinates on the
        // other side: height is below 2^74, and its product with a coordinate below 2^98.
        let height = bottom.2 * top.0 - top.2 * bottom.0;
        let at = |k: usize, last: i32| {
            let coordinate = match height {
                0 => top.1[k] / top.0,
                _ => (top.1[k] * bottom.2 - bottom.1[k] * top.2) / height,
            };
            coordinate.clamp(0, last.into()) as i32
        };
        AffineStepper {
            u: at(0, self.last.0),
            v: at(1, self.last.1),
            du: 0,
            dv: 0,
        }
    }

    /// Returns the stepper by chapter 57's rule, translated to texels that begin at whole numbers.
    ///
    /// The rule knows pixels, but not where in these pixels the crossings lie. It divides the difference
    /// between the coordinates at the two crossings into n equal steps for the n pixels between the
    /// crossings, and puts the first pixel half a step in.
    ///
    /// Error against the exact affine coordinates: at most half a pixel's worth of texture along the span.
    /// Proof: let the crossings be h pixels apart, let the first centre lie f past the first crossing, and
    /// let the last centre lie g before the second. Then n - 1 + f + g = h, with f and g from 0 to 1. Pixel i
    /// gets the coordinate that belongs (i + 1/2) h/n past the first crossing, and its centre lies i + f past
    /// that crossing. With t = (i + 1/2)/n the difference is (1 - t) (1/2 - f) + t (g - 1/2). This lies
    /// between 1/2 - f and g - 1/2, so its magnitude is never above 1/2; it is 1/2 along the whole span where
    /// f = 0 and g = 1. In addition the step is cut to 2^-16 texel towards zero, as in [`Sides::stepper`].
    pub fn half_step(&self, span: &Span) -> AffineStepper {
        // The first pixel whose centre is not above a crossing, on the screen or off it.
        let cell = |at: i64| (at + (1 << 31) - 1) >> 32;
        let [top, bottom] = span.ends.map(|end| cell(end.at));
        // A crossing is off by up to 2^-23 and may appear on the wrong side of a centre.
        let before = (i64::from(span.first) - top).max(0);
        let steps = (bottom - top).max(before + i64::from(span.len));
        let [u, v] = [
            self.ends(span, |s| &s.u).map(|u| (u, self.last.0)),
            self.ends(span, |s| &s.v).map(|v| (v, self.last.1)),
        ]
        .map(|[(from, last), (to, _)]| {
            let [from, to] = [from, to].map(|end| (end >> 16).clamp(0, i64::from(last) + 1));
            let step = (to - from) / steps;
            // Computed from the full difference: the part that the step loses would add up over the pixels
            // before the screen.
            let first = from + (to - from) * (2 * before + 1) / (2 * steps);
            (first.min(i64::from(last)) as i32, step as i32)
        });
        AffineStepper {
            u: u.0,
            v: v.0,
            du: u.1,
            dv: v.1,
        }
    }

    /// Returns a coordinate where the span's line enters the polygon and where it leaves it.
    fn ends(&self, span: &Span, coordinate: fn(&Side) -> &EdgeInterpolant) -> [i64; 2] {
        let line = i32::from(span.line);
        span.ends
            .map(|end| coordinate(&self.sides[end.side]).at(line))
    }
}

/// The single affine map of a triangle: both gradients are computed once, and a span needs no division unless
/// it is cut at the texture's border.
///
/// Legal input: three corners within [`AffineMap::REACH`] of the screen's middle in x and in y, in the
/// texture or on its border, with less than 256 texels per pixel across and down the screen. Other polygons
/// have no map; [`Sides`] makes their steppers.
///
/// Error against the exact affine coordinates: less than 3 2^-16 texel at the first pixel (see
/// [`AffineMap::new`]; this includes rounding down), and less than another n 2^-16 texel after n
/// pixels, because the step is cut towards zero.
#[derive(Clone, Copy, Debug)]
pub struct AffineMap {
    u: Gradient,
    v: Gradient,
    /// The last coordinate inside the texture, across and down.
    last: (i32, i32),
    /// Whether every corner is far enough from the texture's border that rounding cannot lead out of it.
    inside: bool,
}

/// A coordinate that is linear on the screen: 32 fraction bits, steps within +-2^40.
#[derive(Clone, Copy, Debug)]
struct Gradient {
    /// Value at the centre of pixel (0, 0): below 2^52.
    origin: i64,
    right: i64,
    down: i64,
    /// `down` as the step of a stepper: 16 fraction bits, cut towards zero.
    step: i32,
}

impl AffineMap {
    /// Largest distance of a corner from the screen's middle in either direction: 512 pixels, in 1/256 pixel.
    pub const REACH: i32 = 512 * 256;

    /// Returns the map of `polygon` in `texture`, or nothing if the polygon is outside the legal range.
    #[inline]
    pub fn new(polygon: &[Vertex], texture: &Texture<'_>) -> Option<Self> {
        let [a, b, c] = polygon else {
            return None;
        };
        let last = texture.last();
        let near = |at: i32, pixels: usize| {
            let middle = pixels as i32 * 128;
            (middle - Self::REACH..=middle + Self::REACH).contains(&at)
        };
        let legal = |at: &Vertex| {
            near(at.x, WIDTH)
                && near(at.y, HEIGHT)
                && (0..=last.0 + 1).contains(&at.u)
                && (0..=last.1 + 1).contains(&at.v)
        };
        if !(legal(a) && legal(b) && legal(c)) {
            return None;
        }
        // Differences of positions are at most 2^18, and of coordinates 2^24. Three points lie in a box, and
        // the parallelogram that they span is no larger than the box: 2^36 with two positions, and 2^42 with
        // a coordinate for one side.
        let spanned = |p: (i32, i32), q: (i32, i32)| {
            i64::from(p.0) * i64::from(q.1) - i64::from(p.1) * i64::from(q.0)
        };
        let (x, y) = ((b.x - a.x, c.x - a.x), (b.y - a.y, c.y - a.y));
        let area = spanned(x, y);
        if area == 0 {
            return None;
        }
        // One division. `over` is off by less than 1, which moves a gradient by less than 2^42 2^-38 of its
        // units, that is 2^-28 texel per pixel, and a coordinate by 2^-17 texel over 2^10 pixels each way.
        // The last places of the gradients and of the origin add less than another 2^-20.
        let over = (1 << 62) / area;
        let gradient = |at: [i32; 3]| {
            let change = (at[1] - at[0], at[2] - at[0]);
            // n / area 2^24 is below 2^40.
            let [right, down] = [spanned(change, y), spanned(x, change)].map(|n| {
                (n.abs() < area.abs() << 16)
                    .then(|| ((i128::from(n) * i128::from(over)) >> 38) as i64)
            });
            let (right, down) = (right?, down?);
            let to_origin = right * i64::from(128 - a.x) + down * i64::from(128 - a.y);
            Some(Gradient {
                origin: (i64::from(at[0]) << 16) + (to_origin >> 8),
                right,
                down,
                step: (down / (1 << 16)) as i32,
            })
        };
        // A coordinate is off by 3 2^-16 texel at the first pixel. The step, which is cut towards zero, leads
        // no further out.
        let clear = |at: [i32; 3], last: i32| at.iter().all(|at| (4..last - 4).contains(at));
        let (u, v) = ([a.u, b.u, c.u], [a.v, b.v, c.v]);
        Some(Self {
            u: gradient(u)?,
            v: gradient(v)?,
            last,
            inside: clear(u, last.0) && clear(v, last.1),
        })
    }

    /// Returns the map with these values at the centre of pixel (0, 0) and these steps to the right and down;
    /// 32 fraction bits, steps within +-2^40. `inside` states that no pixel is within 4 2^-16 texel of the
    /// texture's border.
    pub(crate) fn of(maps: [(i64, i64, i64); 2], texture: &Texture<'_>, inside: bool) -> Self {
        let [u, v] = maps.map(|(origin, right, down)| Gradient {
            origin,
            right,
            down,
            step: (down / (1 << 16)) as i32,
        });
        Self {
            u,
            v,
            last: texture.last(),
            inside,
        }
    }

    /// Returns the stepper down a span of [`spans()`] or [`columns`](crate::scan::columns).
    ///
    /// If the first or the last pixel lies outside the texture, which only rounding and the far border cause,
    /// both are clamped into it, and the step is computed from the clamped ends.
    #[inline]
    pub fn stepper<End>(&self, span: &Span<End>) -> AffineStepper {
        let (x, y) = (i64::from(span.line), i64::from(span.first));
        let steps = i64::from(span.len) - 1;
        let stepped = |gradient: &Gradient, last: i32| {
            let first = gradient.origin + x * gradient.right + y * gradient.down;
            let start = first >> 16;
            if self.inside {
                return (start as i32, gradient.step);
            }
            let stop = start + steps * i64::from(gradient.step);
            // As an unsigned number, a negative coordinate is above every size.
            let inside = |at: i64| at as u64 <= last as u64;
            if inside(start) && inside(stop) {
                return (start as i32, gradient.step);
            }
            let clamped = |at: i64| at.clamp(0, last.into()) as i32;
            let start = clamped(start);
            let stop = clamped((first + steps * gradient.down) >> 16);
            // A span of one pixel has no step.
            (start, (stop - start) / (steps as i32).max(1))
        };
        let (u, du) = stepped(&self.u, self.last.0);
        let (v, dv) = stepped(&self.v, self.last.1);
        AffineStepper { u, v, du, dv }
    }
}

/// Passes the spans of a face's columns to `sink`, for the loop `by`.
///
/// # Errors
/// If the polygon is outside the legal range; then `sink` has received no span.
pub(crate) fn map(
    by: Loop,
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    match AffineMap::new(face.polygon, texture) {
        Some(map) => map_by(&map, by, face, sink),
        None => map_sides(Axis::Down, Sides::stepper, by, face, texture, sink),
    }
}

/// Passes the spans of a face's columns or rows, with chapter 57's half steps, to `sink`.
///
/// # Errors
/// As for [`map`].
pub(crate) fn map_half_steps(
    axis: Axis,
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    map_sides(axis, Sides::half_step, Loop::fastest(), face, texture, sink)
}

/// Passes the spans of a face's columns to `sink`, by one affine map.
///
/// # Errors
/// As for [`map`].
pub(crate) fn map_by(
    map: &AffineMap,
    by: Loop,
    face: &Face<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    spans(Axis::Down, face.polygon, |span| {
        let stepper = by.effective(map.stepper(&span));
        sink(MappedSpan::new(
            Axis::Down,
            &span,
            SpanKind::Affine(stepper),
        ));
    })
}

fn map_sides(
    axis: Axis,
    rule: fn(&Sides, &Span) -> AffineStepper,
    by: Loop,
    face: &Face<'_>,
    texture: &Texture<'_>,
    sink: &mut dyn FnMut(MappedSpan),
) -> Result<(), Dropped> {
    let sides = Sides::new(face.polygon, texture, axis)?;
    spans_and_crossings(axis, face.polygon, |span| {
        // The span gets the stepper that the loop actually draws, because the reference implementation does
        // not know the loops.
        let stepper = by.effective(rule(&sides, &span));
        sink(MappedSpan::new(axis, &span, SpanKind::Affine(stepper)));
    })
}
