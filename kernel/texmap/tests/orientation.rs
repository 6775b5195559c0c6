//! Chapter 57's complaint: a texture shifts as its polygon turns. Here a parallelogram that is turned by
//! quarters of a turn, or mirrored, must give the turned or mirrored image. The exceptions are pixels whose
//! centre lies on an edge or on a texel's border: there the half-open rules choose a side, and the side does
//! not turn with the image.

use modex::{HEIGHT, PlanarBuffer, WIDTH};
use texmap::plane::Anchor;
use texmap::{Face, JobList, Mapper, Order, Renderer, SUBPIXELS, Texture, Vertex};

/// The centre of the screen in 1/256 pixel, about which everything turns.
const MIDDLE: (i32, i32) = (160 * SUBPIXELS, 120 * SUBPIXELS);
const FOCAL_LENGTH: i32 = 258;
/// 16.16 in space for 1/256 pixel on the screen, at a single depth.
const SCALE: i32 = 16;
const DEPTH: i32 = FOCAL_LENGTH * SUBPIXELS * SCALE;
const SIDE: u16 = 24;

/// A position relative to the centre of the screen.
type Place = (i32, i32);
type Turn = fn(Place) -> Place;

const TURNS: [(&str, Turn); 6] = [
    ("by a quarter", |(x, y)| (-y, x)),
    ("by a half", |(x, y)| (-x, -y)),
    ("by three quarters", |(x, y)| (y, -x)),
    ("left to right", |(x, y)| (-x, y)),
    ("upside down", |(x, y)| (x, -y)),
    ("over a diagonal", |(x, y)| (y, x)),
];

/// A parallelogram's corners in order.
type Corners = [Place; 4];

/// Texture coordinates of the corners, in texels.
const COORDINATES: [(i32, i32); 4] = [(0, 0), (1, 0), (1, 1), (0, 1)];

/// Draws the parallelogram; 0 where nothing is drawn.
fn draw(corners: &Corners, by: Mapper) -> PlanarBuffer {
    // Every texel differs from its neighbours and from its own turned position.
    let texels: Vec<u8> = (0..SIDE * SIDE).map(|i| (i % 251 + 1) as u8).collect();
    let texture = Texture::new(&texels, SIDE, SIDE).unwrap();
    let along = |i: usize| {
        let (u, v) = COORDINATES[i];
        [u, v].map(|k| (k * i32::from(SIDE)) << 16)
    };
    let anchors = [0, 1, 2].map(|i| {
        let [u, v] = along(i);
        let position = [corners[i].0 * SCALE, corners[i].1 * SCALE, DEPTH];
        Anchor { position, u, v }
    });
    let polygon = [0, 1, 2, 3].map(|i| {
        let [u, v] = along(i);
        let (x, y) = (MIDDLE.0 + corners[i].0, MIDDLE.1 + corners[i].1);
        Vertex { x, y, u, v }
    });
    let mut page = PlanarBuffer::new();
    let mut jobs = JobList::<64>::new();
    let textures = [texture];
    let mut renderer = Renderer::new(&mut jobs, &textures, &mut page, by, Order::default());
    renderer.face(&Face {
        polygon: &polygon,
        texture: 0,
        anchors,
        focal_length: FOCAL_LENGTH,
    });
    assert_eq!(renderer.finish().dropped, 0);
    page
}

/// Returns whether a pixel's centre lies on an edge, or on a border between texels. At a single depth the
/// coordinates are affine: u at the centre, in texels, is (centre - P) x N / (M x N), times SIDE.
fn on_a_border(corners: &Corners, centre: Place) -> bool {
    let minus = |a: Place, b: Place| (i64::from(a.0 - b.0), i64::from(a.1 - b.1));
    let cross = |a: (i64, i64), b: (i64, i64)| a.0 * b.1 - a.1 * b.0;
    let (m, n) = (minus(corners[1], corners[0]), minus(corners[3], corners[0]));
    let from = minus(centre, corners[0]);
    let area = cross(m, n);
    [cross(from, n), cross(m, from)]
        .into_iter()
        .any(|part| part * i64::from(SIDE) % area == 0)
}

/// Counts the pixels; those that change with the turn although no border is near; and those that change on a
/// border.
fn compare(by: Mapper, cases: usize) -> [u32; 3] {
    let mut random = seeded::generator();
    let (mut pixels, mut others, mut ties) = (0, 0, 0);
    for case in 0..seeded::cases(cases) {
        // Whole and half pixels produce ties.
        let snap = [1, 128, 256][case % 3];
        let mut place = |reach: i32| {
            let mut at = || random.i32(-reach * SUBPIXELS..=reach * SUBPIXELS) / snap * snap;
            (at(), at())
        };
        let (p, m, n) = (place(30), place(60), place(60));
        let plus = |a: Place, b: Place| (a.0 + b.0, a.1 + b.1);
        let corners = [p, plus(p, m), plus(plus(p, m), n), plus(p, n)];
        if i64::from(m.0) * i64::from(n.1) == i64::from(m.1) * i64::from(n.0) {
            continue;
        }
        let upright = draw(&corners, by);
        for (name, turn) in TURNS {
            let turned = draw(&corners.map(turn), by);
            for (x, y) in (0..WIDTH as i32).flat_map(|x| (0..HEIGHT as i32).map(move |y| (x, y))) {
                let centre = (
                    SUBPIXELS * x + 128 - MIDDLE.0,
                    SUBPIXELS * y + 128 - MIDDLE.1,
                );
                let there = turn(centre);
                let [tx, ty] =
                    [there.0 + MIDDLE.0, there.1 + MIDDLE.1].map(|k| k.div_euclid(SUBPIXELS));
                // A quarter turn moves the screen's left and right parts off the screen.
                if !(0..WIDTH as i32).contains(&tx) || !(0..HEIGHT as i32).contains(&ty) {
                    continue;
                }
                let before = upright.pixel(x as usize, y as usize);
                let after = turned.pixel(tx as usize, ty as usize);
                pixels += u32::from(before != 0);
                if before == after {
                    continue;
                }
                if on_a_border(&corners, centre) {
                    ties += 1;
                    continue;
                }
                others += 1;
                assert!(
                    by != Mapper::Exact,
                    "({x}, {y}) turned {name}: {before} became {after}; {corners:?}"
                );
            }
        }
    }
    println!("{by:?}: of {pixels} pixels {others} became others, and {ties} on a border");
    [pixels, others, ties]
}

#[test]
fn a_turned_polygon_gives_the_turned_frame() {
    let [pixels, others, ties] = compare(Mapper::Exact, 150);
    assert!(!seeded::is_whole() || pixels > 500_000 && ties > 100);
    assert_eq!(others, 0);
}

/// Steps are rounded towards zero, so a stepper in the other direction has the opposite error: at most 2^-8
/// texel.
#[test]
fn affine_columns_shift_a_texture_by_next_to_nothing() {
    let [pixels, others, _] = compare(Mapper::default(), 150);
    assert!(
        !seeded::is_whole() || others * 500 < pixels,
        "{others} of {pixels}"
    );
}

/// The sources' rule is much better than the rule that it replaced, and still shifts a texture visibly: it
/// distributes coordinates over whole pixels.
#[test]
fn half_steps_shift_a_texture_much_more() {
    let [pixels, others, _] = compare(Mapper::HalfStep, 150);
    assert!(
        !seeded::is_whole() || others * 50 > pixels,
        "{others} of {pixels}"
    );
}
