//! Texture coordinates from their definitions. Affine: along the edges to the column's centre, then down the
//! column. Perspective: the floor of a quotient.

use texmap::Vertex;
use texmap::plane::Anchor;

/// A coordinate as a quotient, in 16.16 texels; the divisor is above zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinate {
    /// The dividend.
    pub n: i128,
    /// The divisor.
    pub d: i128,
}

impl Coordinate {
    /// Returns the texels that may be read if the coordinate is off by at most 2^-`bits` texel (`bits` is at
    /// most 16), in a texture of `size` texels: one texel, or two neighbours. The last texel owns its far
    /// border.
    pub fn texels(self, bits: u32, size: u16) -> std::ops::RangeInclusive<u16> {
        let texel = |by: i128| {
            let n = self.n + by * (self.d << (16 - bits));
            let texel = n.div_euclid(self.d << 16);
            texel.clamp(0, i128::from(size) - 1) as u16
        };
        texel(-1)..=texel(1)
    }
}

/// The crossing of an edge with a column's centre: its height and coordinates, times `dx`.
struct Crossing {
    dx: i128,
    y: i128,
    uv: [i128; 2],
}

/// Returns the coordinates at the centre of a pixel inside a convex polygon, or `None` if its column meets no
/// edge above the centre or no edge below it.
///
/// Vertices are within the renderer's limit of 2^23: a side's dx is below 2^24, a crossing times dx below
/// 2^49, the difference of two crossings times both dx below 2^74, and the quotients' parts below 2^124.
pub fn affine(polygon: &[Vertex], x: i32, y: i32) -> Option<[Coordinate; 2]> {
    let [xc, yc] = [x, y].map(|k| i128::from(k) * 256 + 128);
    let mut above: Option<Crossing> = None;
    let mut below: Option<Crossing> = None;
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (a, b) = if a.x <= b.x { (a, b) } else { (b, a) };
        let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(i128::from);
        if !(ax <= xc && xc < bx) {
            continue;
        }
        let (dx, along) = (bx - ax, xc - ax);
        let at = |a: i32, b: i32| i128::from(a) * dx + (i128::from(b) - i128::from(a)) * along;
        let crossing = Crossing {
            dx,
            y: ay * dx + (by - ay) * along,
            uv: [at(a.u, b.u), at(a.v, b.v)],
        };
        if crossing.y == yc * dx {
            // The centre is on the edge, so there is nothing left to interpolate.
            return Some(crossing.uv.map(|n| Coordinate { n, d: dx }));
        }
        let nearer = |held: &Option<Crossing>, lower: bool| match held {
            Some(held) => {
                let (ours, theirs) = (crossing.y * held.dx, held.y * dx);
                if lower { ours < theirs } else { ours > theirs }
            }
            None => true,
        };
        if crossing.y < yc * dx {
            if nearer(&above, false) {
                above = Some(crossing);
            }
        } else if nearer(&below, true) {
            below = Some(crossing);
        }
    }
    let (top, bottom) = (above?, below?);
    // The height between them times both dx, and the part of it above the centre times the top's dx.
    let height = bottom.y * top.dx - top.y * bottom.dx;
    let part = yc * top.dx - top.y;
    Some([0, 1].map(|k| {
        let change = bottom.uv[k] * top.dx - top.uv[k] * bottom.dx;
        Coordinate {
            n: top.uv[k] * height + change * part,
            d: top.dx * height,
        }
    }))
}

/// Returns the texel of a perspective coordinate n / c in a texture of `size` texels: the floor of the
/// quotient, clamped to the texture. On the horizon and beyond it, where c is not above zero, it is the texel
/// that the quotient tends to before the horizon.
pub fn perspective(n: i128, c: i128, size: u16) -> u16 {
    let last = i128::from(size) - 1;
    let texel = match (n < 0, c > 0) {
        (true, _) => 0,
        (false, true) => n.div_euclid(c).min(last),
        (false, false) => last,
    };
    texel as u16
}

/// Returns the three forms of the plane through `anchors` at the centre of a pixel, before quantisation: u =
/// a / c and v = b / c in texels. The weight of each anchor is the volume of the ray with the other two
/// anchors.
///
/// Positions are within 2^24: a product of two is below 2^49 in each part, a weight below 2^61, a form below
/// 2^92 (the focal length is at most 2^15).
pub fn forms(anchors: &[Anchor; 3], focal_length: i32, x: u16, y: u16) -> [i128; 3] {
    let ray = [
        2 * i128::from(x) - 319,
        2 * i128::from(y) - 239,
        2 * i128::from(focal_length),
    ];
    let mut forms = [0; 3];
    let mut volume = 0;
    for i in 0..3 {
        let [p, q] = [1, 2].map(|k| anchors[(i + k) % 3].position.map(i128::from));
        let normal = cross(p, q);
        let weight = dot(ray, normal);
        volume = dot(anchors[i].position.map(i128::from), normal);
        let factors = [i128::from(anchors[i].u), i128::from(anchors[i].v), 1 << 16];
        for (form, factor) in forms.iter_mut().zip(factors) {
            *form += factor * weight;
        }
    }
    forms.map(|form| if volume < 0 { -form } else { form })
}

pub(crate) fn cross(p: [i128; 3], q: [i128; 3]) -> [i128; 3] {
    [0, 1, 2].map(|k| {
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        p[l] * q[m] - p[m] * q[l]
    })
}

pub(crate) fn dot(p: [i128; 3], q: [i128; 3]) -> i128 {
    (0..3).map(|k| p[k] * q[k]).sum()
}
