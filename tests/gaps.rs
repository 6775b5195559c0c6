//! Why edges are integers: reproduces and counts the gaps of the Black Book's figure 57.1.
//!
//! The figure is a turned sheet of quadrilaterals. Its quadrilaterals alternate between two methods of
//! finding edges: integers from whole-pixel vertices, and 16.16 fixed point from the exact vertices. Each
//! method alone would leave no gap; where the two meet, pixels are left out and others are written twice. The
//! image also shows the same sheet as this project draws it, with one exact rule for every quadrilateral.
//!
//! `cargo gaps` writes `docs/gaps.png`.

use std::fs::File;
use std::path::Path;

use frames::indexed::IndexedImage;
use modex::{Destination, HEIGHT, Lane, PlanarBuffer, STRIDE, WIDTH};
use texmap::plane::Anchor;
use texmap::{Face, JobList, Mapper, Order, Renderer, Texture, Vertex};

/// Quadrilaterals of the sheet across and down.
const FIELDS: (i32, i32) = (9, 7);
/// Pixels from one corner of the sheet to the next.
const SIDE: f64 = 23.7;

/// How often each pixel was written, and the kind of quadrilateral that wrote it last.
struct WriteCounts {
    times: Vec<u8>,
    kind: Vec<u8>,
}

impl WriteCounts {
    fn new() -> Self {
        Self {
            times: vec![0; WIDTH * HEIGHT],
            kind: vec![0; WIDTH * HEIGHT],
        }
    }

    fn write(&mut self, x: usize, y: usize, kind: u8) {
        self.times[y * WIDTH + x] += 1;
        self.kind[y * WIDTH + x] = kind;
    }

    /// Counts the pixels of the sheet that no quadrilateral wrote, and the pixels that two wrote. A pixel
    /// belongs to the sheet if its neighbours on two opposite sides are written.
    fn faults(&self) -> (usize, usize) {
        let written = |i: usize| self.times[i] > 0;
        let gap = |&i: &usize| {
            let near = |a: usize, b: usize| written(i - a) && written(i + b);
            !written(i) && (near(1, 1) || near(WIDTH, WIDTH))
        };
        let gaps = (WIDTH..WIDTH * (HEIGHT - 1)).filter(gap).count();
        (gaps, self.times.iter().filter(|&&times| times > 1).count())
    }
}

/// Returns a corner of the sheet on the screen.
fn corner(i: i32, j: i32) -> (f64, f64) {
    let (sin, cos) = 0.23f64.sin_cos();
    let (x, y) = (
        f64::from(2 * i - FIELDS.0) / 2.0 * SIDE,
        f64::from(2 * j - FIELDS.1) / 2.0 * SIDE,
    );
    (160.0 + x * cos - y * sin, 120.0 + x * sin + y * cos)
}

/// Returns each quadrilateral's four corners and its kind.
fn sheet() -> impl Iterator<Item = ([(f64, f64); 4], u8)> {
    (0..FIELDS.1).flat_map(|j| {
        (0..FIELDS.0).map(move |i| {
            let corners = [
                corner(i, j),
                corner(i + 1, j),
                corner(i + 1, j + 1),
                corner(i, j + 1),
            ];
            (corners, ((i + j) % 2) as u8)
        })
    })
}

/// Calls `scan` for each row from the topmost vertex to the lowest, between the x of the edges.
fn by_rows(corners: [(f64, f64); 4], mut scan: impl FnMut(i32, i32, i32)) {
    let fixed = corners.map(|(x, y)| [x, y].map(|k| (k * 65536.0).round() as i64));
    let mut spans = vec![(i64::MAX, i64::MIN); HEIGHT];
    for (i, a) in fixed.iter().enumerate() {
        let b = &fixed[(i + 1) % 4];
        let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        let (top, bottom) = ((a[1] + 0xFFFF) >> 16, (b[1] + 0xFFFF) >> 16);
        if top >= bottom {
            continue;
        }
        // The slope is cut to sixteen bits, and its error adds up from row to row.
        let slope = ((b[0] - a[0]) << 16) / (b[1] - a[1]);
        let mut x = a[0] + ((((top << 16) - a[1]) * slope) >> 16);
        for span in &mut spans[top as usize..bottom as usize] {
            let at = (x + 0xFFFF) >> 16;
            *span = (span.0.min(at), span.1.max(at));
            x += slope;
        }
    }
    for (y, (left, right)) in (0..).zip(spans) {
        if left < right {
            scan(y, left as i32, right as i32);
        }
    }
}

/// Returns the sheet with the two methods of finding edges.
fn mixed() -> WriteCounts {
    let mut page = WriteCounts::new();
    for (corners, kind) in sheet() {
        // Integers only: the vertices are rounded to whole pixels first.
        let corners = match kind {
            0 => corners.map(|(x, y)| (x.round(), y.round())),
            _ => corners,
        };
        by_rows(corners, |y, left, right| {
            for x in left..right {
                page.write(x as usize, y as usize, kind);
            }
        });
    }
    page
}

/// Passes columns on to a page in RAM, and counts each pixel.
struct CountedColumns<'a>(&'a mut WriteCounts, u8, PlanarBuffer);

impl Destination for CountedColumns<'_> {
    fn select(&mut self, _: u16) {}

    fn lane<const STEP: usize>(
        &mut self,
        x: u16,
        y: u16,
        len: u16,
        draw: impl FnOnce(Lane<'_, STEP>),
    ) {
        assert_eq!(STEP, STRIDE, "only columns are drawn");
        for y in y..y + len {
            self.0.write(x.into(), y.into(), self.1);
        }
        self.2.lane(x, y, len, draw);
    }
}

/// Returns the sheet as the renderer draws it.
fn exact() -> WriteCounts {
    let mut page = WriteCounts::new();
    let textures = [Texture::DOT];
    for (corners, kind) in sheet() {
        let polygon = corners.map(|(x, y)| Vertex {
            x: (x * 256.0).round() as i32,
            y: (y * 256.0).round() as i32,
            ..Vertex::default()
        });
        let mut jobs = JobList::<64>::new();
        let mut noted = CountedColumns(&mut page, kind, PlanarBuffer::new());
        let (mapper, order) = (Mapper::default(), Order::default());
        let mut renderer = Renderer::new(&mut jobs, &textures, &mut noted, mapper, order);
        renderer.face(&Face {
            polygon: &polygon,
            texture: 0,
            // Affine mapping needs no plane.
            anchors: [Anchor::default(); 3],
            focal_length: 1,
        });
        renderer.finish();
    }
    page
}

#[test]
fn mixed_edges_leave_gaps_and_exact_edges_do_not() {
    let (gaps, doubles) = mixed().faults();
    assert!(gaps > 50 && doubles > 50, "{gaps} gaps, {doubles} doubles");
    assert_eq!(exact().faults(), (0, 0));
}

#[test]
#[ignore = "writes docs/gaps.png; run it by `cargo gaps`"]
fn both_sheets_are_drawn_side_by_side() {
    const BACKGROUND: u8 = 0;
    const GAP: u8 = 3;
    const DOUBLE: u8 = 4;
    let palette = vec![
        [3, 3, 8],
        [7, 11, 26],
        [12, 19, 36],
        [63, 13, 20],
        [63, 51, 17],
    ];
    let pages = [mixed(), exact()];
    let mut pixels = Vec::new();
    for y in 0..HEIGHT {
        for page in &pages {
            let row = y * WIDTH..(y + 1) * WIDTH;
            pixels.extend(row.map(|i| {
                let written = |i: usize| page.times.get(i).is_some_and(|&times| times > 0);
                match page.times[i] {
                    0 if i > WIDTH
                        && ((written(i - 1) && written(i + 1))
                            || (written(i - WIDTH) && written(i + WIDTH))) =>
                    {
                        GAP
                    }
                    0 => BACKGROUND,
                    1 => 1 + page.kind[i],
                    _ => DOUBLE,
                }
            }));
        }
    }
    for (name, page) in ["mixed", "exact"].iter().zip(&pages) {
        let (gaps, doubles) = page.faults();
        println!("{name}: {gaps} pixels missing, {doubles} written twice");
    }
    // Each pixel is drawn two by two, so that a missing pixel is visible.
    let wide = pixels.chunks(2 * WIDTH).flat_map(|row| {
        let row: Vec<u8> = row.iter().flat_map(|&pixel| [pixel; 2]).collect();
        [row.clone(), row].concat()
    });
    let image = IndexedImage {
        width: 4 * WIDTH,
        height: 2 * HEIGHT,
        palette,
        pixels: wide.collect(),
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/gaps.png");
    image.write_png(File::create(path).unwrap()).unwrap();
}
