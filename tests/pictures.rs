//! Whole pictures against the oracle: every golden's, drawn again from the snapped polygons by the
//! definitions, pixel by pixel, with background, light and palette indices.

use std::fmt;

use crystal_ball::golden;
use link::Picture;
use modex::{HEIGHT, PlanarBuffer, WIDTH};
use oracle::coverage::inside;
use oracle::texel::affine;
use scene::{Drawn, FOCAL_LENGTH, Mapper, Pose, Stage, Storage};
use texmap::plane::Plane;
use texmap::{Point, Texture};

/// The affine mapper's coordinates are within 2^-7 texel of the exact ones: 2^-8 where a whole
/// texture is squeezed into a sliver, and 240 steps, each cut by less than 2^-16.
const AFFINE_BITS: u32 = 7;

fn pose(picture: Picture) -> Pose {
    match picture {
        Picture::Frame(frame) => Pose::at_tick(frame),
        Picture::Pose {
            yaw,
            pitch,
            roll,
            distance,
        } => Pose {
            yaw,
            pitch,
            roll,
            distance: distance as i32,
        },
    }
}

/// What the definitions allow at each pixel: the colours, and how many polygons cover it.
struct Expected {
    colours: Vec<Vec<u8>>,
    covered: Vec<u8>,
}

impl fmt::Debug for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an expected picture")
    }
}

/// The colours that `texture` has where `drawn` is seen through the centre of (x, y).
fn colours(drawn: &Drawn<'_>, texture: &Texture<'_>, mapper: Mapper, x: i32, y: i32) -> Vec<u8> {
    let (width, height) = (texture.width(), texture.height());
    let (columns, rows) = match mapper {
        Mapper::Exact => {
            // The definition: the floor of the quotient of the plane's integers.
            let plane = Plane::new(&drawn.anchors, FOCAL_LENGTH);
            let at = |form: texmap::plane::Form| {
                let along = i128::from(form.right) * i128::from(x);
                i128::from(form.origin) + along + i128::from(form.down) * i128::from(y)
            };
            let (a, b, c) = (at(plane.a), at(plane.b), at(plane.c));
            let texel = |n: i128, size: u16| {
                let last = i128::from(size) - 1;
                let texel = match (n < 0, c > 0) {
                    (true, _) => 0,
                    (false, true) => n.div_euclid(c).min(last),
                    (false, false) => last,
                };
                texel as u16..=texel as u16
            };
            (texel(a, width), texel(b, height))
        }
        _ => {
            let [u, v] = affine(drawn.polygon, x, y).expect("the centre is between two edges");
            (u.texels(AFFINE_BITS, width), v.texels(AFFINE_BITS, height))
        }
    };
    let texel = |i, j: u16| texture.texels()[usize::from(j) * usize::from(width) + usize::from(i)];
    rows.flat_map(|j| columns.clone().map(move |i| (i, j)))
        .map(|(i, j)| texel(i, j))
        .collect()
}

fn expected(stage: &mut Stage<'_>, pose: &Pose, mapper: Mapper) -> Expected {
    let background = stage.background();
    let mut expected = Expected {
        colours: (0..WIDTH * HEIGHT)
            .map(|i| vec![background[i / WIDTH]])
            .collect(),
        covered: vec![0; WIDTH * HEIGHT],
    };
    let mut seen = Vec::new();
    stage.polygons(pose, |drawn| {
        let drawn = drawn.expect("nothing legal is dropped");
        seen.push((drawn.polygon.to_vec(), drawn.surface, drawn.anchors));
    });
    for (polygon, surface, anchors) in seen {
        let texture = stage.surface(surface);
        let drawn = Drawn {
            polygon: &polygon,
            surface,
            anchors,
        };
        let points: Vec<Point> = polygon.iter().map(|&vertex| vertex.into()).collect();
        // Every pixel whose centre may be inside, and one more around.
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
                expected.covered[i] += 1;
                expected.colours[i] = colours(&drawn, &texture, mapper, x, y);
            }
        }
    }
    expected
}

/// Compares a picture's pixels with what is expected; how many there were in all.
fn compare(name: &str, expected: &Expected, pixel: impl Fn(usize) -> u8) {
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

#[test]
fn every_golden_is_what_the_oracle_draws() {
    let mut texels = Box::new([0; scene::TEXELS]);
    let textures = [scene::paint_ball(&mut texels)];
    let mut storage = Box::new(Storage::new());
    let mut stage = Stage::new(&mut storage, scene::ball(&textures));
    let mut between = 0;
    for golden in golden::find(&golden::folder()).unwrap() {
        let pose = pose(*golden.show.last().unwrap());
        // The committed picture: affine.
        let picture = golden.picture().unwrap().expect("it was blessed");
        let affine = expected(&mut stage, &pose, Mapper::Affine);
        compare(&golden.name, &affine, |i| picture.pixels[i]);
        between += affine
            .colours
            .iter()
            .filter(|allowed| allowed.len() > 1)
            .count();
        // The same with perspective, where every texel is the one.
        let exact = expected(&mut stage, &pose, Mapper::Exact);
        let mut page = Box::new(PlanarBuffer::new());
        page.clear(stage.background());
        stage.set_mapper(Mapper::Exact);
        let stats = stage.draw(&pose, &mut *page);
        stage.set_mapper(Mapper::Affine);
        assert_eq!(stats.dropped, 0, "{}", golden.name);
        let name = format!("{} by the exact mapper", golden.name);
        compare(&name, &exact, |i| page.pixel(i % WIDTH, i / WIDTH));
    }
    println!("{between} pixels so near to a texel's border that affine columns may read either");
}
