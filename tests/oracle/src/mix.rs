//! Random polygons that are likely to fail, in named mixes.
//!
//! A case depends only on the seed, its mix and its number: a sweep can resume anywhere, and a failure can be
//! repeated.

use fastrand::Rng;
use texmap::{MAX_COORDINATE, Point};

use crate::check::CoverageCase;
use crate::coverage::{HEIGHT, WIDTH};

/// A kind of polygon. Every case has the property that the kind's name states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PolygonMix {
    /// All vertices on pixel centres.
    Centres,
    /// All vertices on pixel edges, or on pixel corners.
    Borders,
    /// All sides except the last are horizontal, vertical or diagonal.
    Straight,
    /// Two long chains of sides 1/256 pixel apart.
    Slivers,
    /// Zero area: all vertices on a line.
    Flat,
    /// At least one vertex occurs more than once.
    Repeated,
    /// Some vertices lie in the middle of a side.
    Collinear,
    /// Non-convex, most of them self-crossing.
    Crossing,
    /// Positive area, as seen from the front.
    Clockwise,
    /// Negative area.
    Anticlockwise,
    /// Partly outside the screen.
    Outside,
    /// At least one vertex is 10 000 pixels or more off the screen, many are at the limit.
    Far,
    /// Less than a pixel wide and high.
    Tiny,
    /// Closed fans of triangles around a point.
    Fans,
    /// Meshes of triangles and quadrangles.
    Meshes,
}

impl PolygonMix {
    /// All mixes.
    pub const ALL: [Self; 15] = [
        Self::Centres,
        Self::Borders,
        Self::Straight,
        Self::Slivers,
        Self::Flat,
        Self::Repeated,
        Self::Collinear,
        Self::Crossing,
        Self::Clockwise,
        Self::Anticlockwise,
        Self::Outside,
        Self::Far,
        Self::Tiny,
        Self::Fans,
        Self::Meshes,
    ];

    /// Returns the mix's name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Centres => "vertices on pixel centres",
            Self::Borders => "vertices on pixel edges",
            Self::Straight => "level, upright, diagonal",
            Self::Slivers => "slivers of 1/256",
            Self::Flat => "zero area",
            Self::Repeated => "repeated vertices",
            Self::Collinear => "collinear vertices",
            Self::Crossing => "non-convex, self-crossing",
            Self::Clockwise => "clockwise",
            Self::Anticlockwise => "anticlockwise",
            Self::Outside => "partly outside",
            Self::Far => "far outside",
            Self::Tiny => "below a pixel",
            Self::Fans => "closed fans",
            Self::Meshes => "meshes",
        }
    }

    /// Returns case `number` of this mix.
    pub fn case(self, seed: u64, number: u64) -> CoverageCase {
        let mut draw = PolygonGenerator {
            random: stream(seed, self as u64, number),
        };
        let polygon = match self {
            Self::Centres => draw.centres(),
            Self::Borders => draw.borders(),
            Self::Straight => draw.straight(),
            Self::Slivers => draw.sliver(),
            Self::Flat => draw.flat(),
            Self::Repeated => draw.repeated(),
            Self::Collinear => draw.collinear(),
            Self::Crossing => draw.until(|p| !is_convex(p), PolygonGenerator::anything),
            Self::Clockwise => draw.wound(1),
            Self::Anticlockwise => draw.wound(-1),
            Self::Outside => draw.outside(),
            Self::Far => draw.until(is_far, PolygonGenerator::far),
            Self::Tiny => draw.tiny(),
            Self::Fans => return draw.fan(),
            Self::Meshes => return draw.mesh(),
        };
        CoverageCase {
            polygons: vec![polygon],
            outline: None,
        }
    }
}

/// Returns the random numbers of a case. No two kinds of cases use the same `mix`.
pub(crate) fn stream(seed: u64, mix: u64, number: u64) -> Rng {
    Rng::with_seed(scramble(scramble(seed ^ scramble(mix)) ^ number))
}

/// Returns the finaliser of splitmix64: neighbouring inputs give unrelated outputs.
fn scramble(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}

type Polygon = Vec<Point>;

fn point(x: i32, y: i32) -> Point {
    Point { x, y }
}

/// Returns twice the area of the triangle; positive if it is clockwise on the screen, y down.
fn area(a: Point, b: Point, c: Point) -> i64 {
    let d = |a: i32, b: i32| i64::from(b) - i64::from(a);
    d(a.x, b.x) * d(a.y, c.y) - d(a.x, c.x) * d(a.y, b.y)
}

fn polygon_area(polygon: &[Point]) -> i64 {
    let next = polygon.iter().cycle().skip(1);
    let sides = polygon.iter().zip(next);
    sides.map(|(&a, &b)| area(point(0, 0), a, b)).sum()
}

/// Returns whether the polygon never turns both ways.
fn is_convex(polygon: &[Point]) -> bool {
    let n = polygon.len();
    let turns = (0..n).map(|i| area(polygon[i], polygon[(i + 1) % n], polygon[(i + 2) % n]));
    turns.clone().all(|turn| turn >= 0) || turns.clone().all(|turn| turn <= 0)
}

fn is_far(polygon: &[Point]) -> bool {
    let far = 10_000 * 256;
    polygon.iter().any(|p| p.x.abs() > far || p.y.abs() > far)
}

fn is_on_screen(p: &Point) -> bool {
    (0..WIDTH * 256).contains(&p.x) && (0..HEIGHT * 256).contains(&p.y)
}

/// Returns the half turn that contains the direction. The sign of the area orders the directions within a
/// half turn.
fn half(d: Point) -> bool {
    d.y < 0 || d.y == 0 && d.x < 0
}

struct PolygonGenerator {
    random: Rng,
}

impl PolygonGenerator {
    fn until(&mut self, good: fn(&[Point]) -> bool, draw: fn(&mut Self) -> Polygon) -> Polygon {
        loop {
            let polygon = draw(self);
            if good(&polygon) {
                return polygon;
            }
        }
    }

    fn sides(&mut self) -> usize {
        self.random.usize(3..=8)
    }

    /// Returns the distance from a polygon's centre to its vertices: a fraction of a pixel to 16 pixels, and
    /// sometimes beyond the screen.
    fn reach(&mut self) -> i32 {
        let bits = if self.random.u8(..) < 6 {
            self.random.u32(13..=17)
        } else {
            self.random.u32(5..=12)
        };
        (1 << bits) + self.random.i32(0..1 << bits)
    }

    /// Returns a random grid spacing for positions, in 1/256 pixel.
    fn grid(&mut self) -> i32 {
        self.random.choice([1, 1, 16, 64, 128, 128, 256]).unwrap()
    }

    fn within(&mut self, reach: i32) -> i32 {
        self.random.i32(-reach..=reach)
    }

    /// Returns a point on the screen or just beyond, at a multiple of `grid`, plus `off`.
    fn middle(&mut self, grid: i32, off: i32) -> Point {
        let mut place = |pixels: i32| {
            let place = self.random.i32(-8 * 256..(pixels + 8) * 256);
            place / grid * grid + off
        };
        point(place(WIDTH), place(HEIGHT))
    }

    /// Returns vertices around a centre, all at multiples of `grid`, plus `off`.
    fn around(&mut self, sides: usize, grid: i32, off: i32) -> Polygon {
        let reach = self.reach().max(2 * grid);
        let middle = self.middle(grid, off);
        let mut place = |middle: i32| middle + self.within(reach) / grid * grid;
        let vertex = |_| point(place(middle.x), place(middle.y));
        (0..sides).map(vertex).collect()
    }

    /// Returns vertices on centres, on edges, or on neither.
    fn anything(&mut self) -> Polygon {
        let (sides, grid) = (self.sides(), self.grid());
        let off = self.random.choice([0, 128]).unwrap();
        self.around(sides, grid, off)
    }

    fn centres(&mut self) -> Polygon {
        let sides = self.sides();
        self.around(sides, 256, 128)
    }

    fn borders(&mut self) -> Polygon {
        let sides = self.sides();
        let mut polygon = self.around(sides, 256, 0);
        for p in &mut polygon {
            let off = [128, self.random.i32(0..256)][self.random.usize(..2)];
            match self.random.u8(0..4) {
                0 => p.x += off,
                1 => p.y += off,
                _ => {}
            }
        }
        polygon
    }

    fn straight(&mut self) -> Polygon {
        let (sides, grid) = (self.sides(), self.grid());
        let off = self.random.choice([0, 128]).unwrap();
        let reach = self.reach().max(2 * grid);
        let mut at = self.middle(grid, off);
        let mut polygon = vec![at];
        while polygon.len() < sides {
            let (dx, dy) = self
                .random
                .choice([(1, 0), (0, 1), (1, 1), (1, -1)])
                .unwrap();
            let length = self.within(reach) / grid * grid;
            at = point(at.x + dx * length, at.y + dy * length);
            polygon.push(at);
        }
        polygon
    }

    fn sliver(&mut self) -> Polygon {
        let sides = self.sides();
        let ends = self.anything();
        let (a, b) = (ends[0], ends[1]);
        let mut places: Vec<_> = (0..sides).map(|_| self.random.i64(0..=16)).collect();
        let out = self.random.usize(1..sides);
        places[..out].sort_unstable();
        places[out..].sort_unstable_by(|a, b| b.cmp(a));
        let part = |from: i32, to: i32, place: i64| {
            (i64::from(from) + (i64::from(to) - i64::from(from)) * place / 16) as i32
        };
        // The way back runs beside the way out.
        let (dx, dy) = self
            .random
            .choice([(1, 0), (0, 1), (-1, 1), (1, 1)])
            .unwrap();
        let vertex = |(i, &place): (usize, &i64)| {
            let p = point(part(a.x, b.x, place), part(a.y, b.y, place));
            if i < out {
                p
            } else {
                point(p.x + dx, p.y + dy)
            }
        };
        places.iter().enumerate().map(vertex).collect()
    }

    fn flat(&mut self) -> Polygon {
        let (sides, grid) = (self.sides(), self.grid());
        let off = self.random.choice([0, 128]).unwrap();
        let from = self.middle(grid, off);
        let (dx, dy) = (self.within(4) * grid, self.within(4) * grid);
        let far = self.reach() / grid / 4 + 1;
        let vertex = |_| {
            let k = self.within(far);
            point(from.x + k * dx, from.y + k * dy)
        };
        (0..sides).map(vertex).collect()
    }

    fn repeated(&mut self) -> Polygon {
        let mut polygon = self.anything();
        let sides = polygon.len();
        for _ in 0..self.random.usize(1..sides) {
            let from = polygon[self.random.usize(..sides)];
            polygon[self.random.usize(..sides)] = from;
        }
        // Each copy above may have copied a vertex onto itself.
        polygon[1] = polygon[self.random.choice([0, 2]).unwrap()];
        polygon
    }

    fn collinear(&mut self) -> Polygon {
        // A triangle whose sides are `parts` times a whole vector, and vertices between.
        let grid = self.grid();
        let off = self.random.choice([0, 128]).unwrap();
        let parts = self.random.i32(2..=6);
        let reach = (self.reach() / parts / grid).max(1);
        let a = self.middle(grid, off);
        let mut corner = || {
            let (dx, dy) = (self.within(reach), self.within(reach));
            point(a.x + parts * grid * dx, a.y + parts * grid * dy)
        };
        let corners = [a, corner(), corner()];
        let extra = self.random.usize(1..=5);
        let mut places: Vec<_> = (0..extra)
            .map(|_| (self.random.usize(0..3), self.random.i32(1..parts)))
            .chain((0..3).map(|side| (side, 0)))
            .collect();
        places.sort_unstable();
        let vertex = |&(side, part): &(usize, i32)| {
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            let between = |a: i32, b: i32| a + (b - a) / parts * part;
            point(between(a.x, b.x), between(a.y, b.y))
        };
        places.iter().map(vertex).collect()
    }

    fn wound(&mut self, sign: i64) -> Polygon {
        let mut polygon = self.until(
            |p| polygon_area(p) != 0,
            |draw| {
                let (sides, grid) = (draw.sides(), draw.grid());
                let off = draw.random.choice([0, 128]).unwrap();
                let middle = draw.middle(grid, off);
                let ring = draw.ring(sides, grid);
                let place = |d: &Point| point(middle.x + d.x, middle.y + d.y);
                ring.iter().map(place).collect()
            },
        );
        if polygon_area(&polygon).signum() != sign {
            polygon.reverse();
        }
        polygon
    }

    /// Returns vectors sorted by direction, clockwise on the screen; if there are four or more, each quadrant
    /// has at least one.
    fn ring(&mut self, count: usize, grid: i32) -> Polygon {
        let reach = self.reach().max(2 * grid);
        let mut ring = Vec::new();
        for i in 0..count {
            let mut length = |least| self.random.i32(least..=reach / grid) * grid;
            let (a, b) = (length(1), length(0));
            ring.push([point(a, b), point(-b, a), point(-a, -b), point(b, -a)][i % 4]);
        }
        let origin = point(0, 0);
        ring.sort_unstable_by(|&a, &b| half(a).cmp(&half(b)).then(area(origin, b, a).cmp(&0)));
        ring
    }

    fn outside(&mut self) -> Polygon {
        loop {
            let mut polygon = self.anything();
            let mut shift = |pixels: i32| self.random.choice([-pixels, 0, pixels]).unwrap() * 128;
            let (dx, dy) = (shift(WIDTH), shift(HEIGHT));
            for p in &mut polygon {
                *p = point(p.x + dx, p.y + dy);
            }
            let on_screen = polygon.iter().filter(|p| is_on_screen(p)).count();
            if (1..polygon.len()).contains(&on_screen) {
                return polygon;
            }
        }
    }

    fn far(&mut self) -> Polygon {
        let middle = self.anything();
        let sides = self.sides();
        let mut place = |on_screen: i32| {
            let limit = MAX_COORDINATE;
            match self.random.u8(0..8) {
                0 => limit,
                1 => -limit,
                2 => limit - self.random.i32(0..512),
                3 => -limit + self.random.i32(0..512),
                4 => self.within(limit),
                5 => self.within(limit) / 16,
                // The centre of the outermost pixel whose centre is inside the limit.
                6 => self.within(limit - 128) / 256 * 256 + 128,
                _ => on_screen,
            }
        };
        let vertex = |_| point(place(middle[0].x), place(middle[1].y));
        (0..sides).map(vertex).collect()
    }

    fn tiny(&mut self) -> Polygon {
        let sides = self.sides();
        let middle = self.middle(256, 128);
        // At the pixel's centre, at a corner, or anywhere.
        let off = self.random.choice([0, 128]).unwrap();
        let off = [off, off, self.within(128)][self.random.usize(..3)];
        let reach = (2 << self.random.u32(0..=6)) - 1;
        let vertex = |_| {
            let (dx, dy) = (self.within(reach), self.within(reach));
            point(middle.x + off + dx, middle.y + off + dy)
        };
        (0..sides).map(vertex).collect()
    }

    /// Returns a closed fan of triangles. All triangles turn the same way, and once around in total, so no
    /// two overlap, and together they fill the ring.
    fn fan(&mut self) -> CoverageCase {
        let grid = self.grid();
        let off = self.random.choice([0, 128]).unwrap();
        let count = self.random.usize(4..=12);
        let middle = self.middle(grid, off);
        let mut ring = self.ring(count, grid);
        for p in &mut ring {
            *p = point(middle.x + p.x, middle.y + p.y);
        }
        if self.random.bool() {
            ring.reverse();
        }
        let next = ring.iter().cycle().skip(1);
        let triangles = ring.iter().zip(next).map(|(&a, &b)| {
            let mut triangle = vec![middle, a, b];
            triangle.rotate_left(self.random.usize(..3));
            triangle
        });
        CoverageCase {
            polygons: triangles.collect(),
            outline: Some(ring),
        }
    }

    /// Returns a lattice whose points move by at most a quarter of its spacing. That turns no triangle over,
    /// so no two overlap, and together they fill the border.
    fn mesh(&mut self) -> CoverageCase {
        let spacing = self
            .random
            .choice([1, 4, 16, 64, 128, 256, 512, 1024])
            .unwrap();
        let spacing = spacing * self.random.i32(1..=3);
        let (columns, rows) = (self.random.usize(1..=4), self.random.usize(1..=4));
        let off = self.random.choice([0, 128]).unwrap();
        let from = self.middle(256, off);
        let reach = self.random.choice([0, spacing / 4]).unwrap();
        let grid = self.random.choice([1, 64, 128]).unwrap();
        let mut places = Vec::new();
        for row in 0..=rows as i32 {
            for column in 0..=columns as i32 {
                let (dx, dy) = (self.within(reach), self.within(reach));
                places.push(point(
                    from.x + column * spacing + dx / grid * grid,
                    from.y + row * spacing + dy / grid * grid,
                ));
            }
        }
        let at = |column: usize, row: usize| places[row * (columns + 1) + column];
        let mut polygons = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                    .map(|(right, down)| at(column + right, row + down));
                match self.random.u8(0..5) {
                    0 => polygons.push(vec![a, b, c, d]),
                    1 | 2 => polygons.extend([vec![a, b, c], vec![c, d, a]]),
                    _ => polygons.extend([vec![b, d, a], vec![b, c, d]]),
                }
            }
        }
        let top = (0..columns).map(|column| at(column, 0));
        let right = (0..rows).map(|row| at(columns, row));
        let bottom = (1..=columns).rev().map(|column| at(column, rows));
        let left = (1..=rows).rev().map(|row| at(0, row));
        CoverageCase {
            polygons,
            outline: Some(top.chain(right).chain(bottom).chain(left).collect()),
        }
    }
}
