//! Compares whole frames with the oracle: draws every golden again, pixel by pixel, by the definitions, from
//! the snapped polygons, with background, light and palette indices.

use std::fmt;

use crystal_ball::golden_folder;
use frames::golden::{self, Golden};
use modex::{HEIGHT, PlanarBuffer, WIDTH};
use oracle::coverage::inside;
use oracle::depth;
use oracle::solid::{self, Solid, SolidChecker, SolidCounts};
use oracle::texel::{affine, perspective};
use render::{RenderMemory, RenderOptions, SceneRenderer};
use scene::catalogue::{CATALOGUE, Entry, MAX_TEXELS};
use scene::{FOCAL_LENGTH, Pose};
use texmap::{Face, Loop, Mapper, Point, Texture};

/// The affine mapper's coordinates are within 2^-7 texel of the exact coordinates: 2^-8 where a whole texture
/// is squeezed into a sliver, and 240 steps, each rounded by less than 2^-16.
const AFFINE_BITS: u32 = 7;

/// Returns a golden's scene.
fn scene(golden: &Golden) -> &'static Entry<'static> {
    let scene = golden.options.scene.and_then(Entry::parse);
    scene.unwrap_or(&CATALOGUE[0])
}

/// Returns the pose of a golden's last frame.
fn pose(golden: &Golden) -> Pose {
    let frame = golden.show.last().expect("a golden shows something");
    demo::pose(scene(golden), *frame).expect("a golden's pose is legal")
}

/// What the definitions allow at each pixel: the colours, and the number of polygons that cover it. Polygons
/// that hide each other count as one.
struct ExpectedFrame {
    colours: Vec<Vec<u8>>,
    covered: Vec<u8>,
}

impl fmt::Debug for ExpectedFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an expected frame")
    }
}

/// Returns the colours of `texture` that the definition allows for the face `drawn` at the centre of (x, y).
fn colours(drawn: &Face<'_>, texture: &Texture<'_>, mapper: Mapper, x: i32, y: i32) -> Vec<u8> {
    let (width, height) = (texture.width(), texture.height());
    let (columns, rows) = match mapper {
        Mapper::Exact => {
            // The definition: the floor of the quotient of the plane's integers.
            let plane = drawn.plane();
            let at = |form: texmap::plane::Form| {
                let along = i128::from(form.right) * i128::from(x);
                i128::from(form.origin) + along + i128::from(form.down) * i128::from(y)
            };
            let (a, b, c) = (at(plane.a), at(plane.b), at(plane.c));
            let texel = |n: i128, size: u16| {
                let texel = perspective(n, c, size);
                texel..=texel
            };
            (texel(a, width), texel(b, height))
        }
        _ => {
            let [u, v] = affine(drawn.polygon, x, y).expect("the centre is between two edges");
            (u.texels(AFFINE_BITS, width), v.texels(AFFINE_BITS, height))
        }
    };
    // A tiled texture stores only the texels of its tile.
    let (across, down) = texture.tile().unwrap_or((width, height));
    let texel = |i: u16, j: u16| {
        let (i, j) = (i % across, j % down);
        texture.texels()[usize::from(j) * usize::from(texture.pitch()) + usize::from(i)]
    };
    rows.flat_map(|j| columns.clone().map(move |i| (i, j)))
        .map(|(i, j)| texel(i, j))
        .collect()
}

fn expected(renderer: &mut SceneRenderer<'_>, pose: &Pose, mapper: Mapper) -> ExpectedFrame {
    let (background, convex) = (renderer.background(), renderer.is_convex());
    let mut expected = ExpectedFrame {
        colours: (0..WIDTH * HEIGHT)
            .map(|i| vec![background[i / WIDTH]])
            .collect(),
        covered: vec![0; WIDTH * HEIGHT],
    };
    let mut seen = Vec::new();
    let nearest = depth::nearest(renderer, pose);
    renderer.at(pose).faces(|number, drawn| {
        let drawn = drawn.expect("no legal face is dropped");
        seen.push((number, drawn.polygon.to_vec(), drawn.texture, drawn.anchors));
    });
    for (number, polygon, surface, anchors) in seen {
        let texture = renderer.surface(surface);
        let drawn = Face {
            polygon: &polygon,
            texture: surface,
            anchors,
            focal_length: FOCAL_LENGTH,
        };
        let points: Vec<Point> = polygon.iter().map(|&vertex| vertex.into()).collect();
        // Every pixel whose centre may be inside, and a margin around them.
        let span = |of: fn(&Point) -> i32, end: usize| {
            let least = points.iter().map(of).min().unwrap_or(0) / 256 - 2;
            let most = points.iter().map(of).max().unwrap_or(0) / 256 + 2;
            least.clamp(0, end as i32)..most.clamp(0, end as i32)
        };
        for y in span(|p| p.y, HEIGHT) {
            for x in span(|p| p.x, WIDTH) {
                if !inside(&points, x, y) {
                    continue;
                }
                let i = y as usize * WIDTH + x as usize;
                expected.covered[i] += u8::from(convex || expected.covered[i] == 0);
                if nearest[i][0] == number {
                    expected.colours[i] = colours(&drawn, &texture, mapper, x, y);
                }
            }
        }
    }
    expected
}

/// Compares a frame's pixels with the expected pixels.
fn compare(name: &str, expected: &ExpectedFrame, pixel: impl Fn(usize) -> u8) {
    for (i, (allowed, covered)) in expected.colours.iter().zip(&expected.covered).enumerate() {
        let (x, y) = (i % WIDTH, i / WIDTH);
        assert!(
            *covered <= 1,
            "{name}: ({x}, {y}) is covered {covered} times"
        );
        let colour = pixel(i);
        assert!(
            allowed.contains(&colour),
            "{name}: ({x}, {y}) is {colour:02x}, not {allowed:02x?}"
        );
    }
}

/// Compares only which pixels show the background; another test checks the texels.
fn compare_coverage(
    name: &str,
    expected: &ExpectedFrame,
    background: &[u8],
    pixel: impl Fn(usize) -> u8,
) {
    for (i, covered) in expected.covered.iter().enumerate() {
        let (x, y) = (i % WIDTH, i / WIDTH);
        // No texel has a colour of the background.
        let drawn = pixel(i) != background[y];
        assert_eq!(
            drawn,
            *covered == 1,
            "{name}: ({x}, {y}) is covered {covered} times"
        );
    }
}

#[test]
fn the_oracle_draws_every_golden() {
    let mut texels = Box::new([0; MAX_TEXELS]);
    let textures = CATALOGUE[0].paint(&mut texels);
    let mut memory = in_place::boxed!(RenderMemory);
    let mut renderer = SceneRenderer::new(&mut memory, CATALOGUE[0].scene(&textures));
    let mut between = 0;
    for golden in golden::find(&golden_folder()).unwrap() {
        let entry = scene(&golden);
        let mut texels = Box::new([0; MAX_TEXELS]);
        renderer.set(entry.scene(&entry.paint(&mut texels)));
        let pose = pose(&golden);
        // The committed PNG.
        let frame = golden.frame().unwrap().expect("the golden was blessed");
        let affine = expected(&mut renderer, &pose, Mapper::default());
        let mapper = golden.options.mapper.unwrap_or_default();
        let background = renderer.background();
        match mapper {
            // The loop of this mapper has shorter fractions.
            Mapper::Affine(Loop::Packed) => {
                compare_coverage(&golden.name, &affine, background, |i| frame.pixels[i]);
            }
            Mapper::Affine(_) => compare(&golden.name, &affine, |i| frame.pixels[i]),
            _ => compare_coverage(&golden.name, &affine, background, |i| frame.pixels[i]),
        }
        between += affine
            .colours
            .iter()
            .filter(|allowed| allowed.len() > 1)
            .count();
        // The same frame by the exact mapper, for which only one texel is right.
        let exact = expected(&mut renderer, &pose, Mapper::Exact);
        let mut page = Box::new(PlanarBuffer::new());
        page.clear(background);
        let options = RenderOptions {
            mapper: Mapper::Exact,
            ..RenderOptions::default()
        };
        let stats = renderer.draw(&pose, options, &mut *page).stats;
        assert_eq!(stats.dropped, 0, "{}", golden.name);
        let name = format!("{} by the exact mapper", golden.name);
        compare(&name, &exact, |i| page.pixel(i % WIDTH, i / WIDTH));
    }
    println!("{between} pixels so near to a texel's border that affine columns may read either");
}

/// Compares with the second oracle, which does not snap: a ray meets a face if it passes each of its edges on
/// the same side, which is the sign of an exact determinant in view space, and meets it beyond the near
/// plane. No pixel further than 1/128 pixel from a true edge may change sides.
#[test]
fn snapping_changes_no_pixel_further_than_a_128th_from_a_true_edge() {
    let mut random = seeded::generator();
    let mut checker = SolidChecker::default();
    let ball = Solid::ball();
    let mut compare = |solid: &Solid, pose: &Pose| {
        let compared = checker.by_sight(solid, pose);
        compared.unwrap_or_else(|wrong| panic!("{wrong}: {pose:?}"))
    };
    let mut far = SolidCounts::default();
    let mut goldens = golden::find(&golden_folder()).unwrap();
    goldens.retain(|golden| scene(golden).name == "ball");
    for golden in goldens.iter().take(seeded::cases(goldens.len())) {
        far += compare(&ball, &pose(golden));
    }
    for _ in 0..seeded::cases(100) {
        let furthest = 1 << random.u32(18..24);
        let distance = random.i32(66_000..furthest);
        far += compare(&ball, &solid::pose(&mut random, distance));
    }
    let mut near = SolidCounts::default();
    for _ in 0..seeded::cases(60) {
        // Within 1/512 or 1/8 unit of a vertex along each axis; the near plane is at 1/512 unit.
        let reach = random.choice([128, 1 << 13]).unwrap();
        let vertex = ball.vertices[random.usize(..ball.vertices.len())];
        let eye = vertex.map(|k| k + random.i32(-reach..=reach));
        let seen = ball.clone().seen_from(eye);
        let pose = solid::pose(&mut random, 0);
        near += compare(&seen, &pose);
        near += compare(&seen.inside_out(), &pose);
    }
    for (name, compared) in [("from afar", &far), ("from nearby", &near)] {
        let SolidCounts {
            pixels,
            changed,
            furthest,
            cut: [by_near, by_guard],
            cut_away,
            ..
        } = compared;
        println!(
            "{name}: {pixels} pixels, {changed} changed sides, at most {furthest:.5} from a true edge; \
             the near plane cut {by_near} faces that are seen, the guard band {by_guard}; \
             {cut_away} pixels cut away"
        );
        assert!(
            !seeded::is_whole() || *changed > 50,
            "only {changed} of {pixels} changed sides"
        );
    }
    let by_near = near.cut[0];
    assert!(
        !seeded::is_whole() || by_near > 20 && near.cut_away > 10_000,
        "{near:?}"
    );
}
