//! Whole solids at every distance: nothing is dropped, and from inside no pixel is left out or written twice.
//! Failures that a sweep of solids finds are pasted in here.

use modex::{HEIGHT, PlanarBuffer, WIDTH};
use oracle::solid::{PixelCounter, Solid, SolidChecker, SolidCounts, SolidMix, length, pose};
use render::{RenderMemory, RenderOptions};
use scene::{MAX_CORNERS, MAX_EXTENT, Pose, Vec3};

#[test]
fn at_every_distance_nothing_is_dropped() {
    let mut random = seeded::generator();
    let mut memory = in_place::boxed!(RenderMemory);
    let unit = 1 << 16;
    for solid in [
        Solid::ball(),
        Solid::cuboid([unit; 3]),
        Solid::cuboid([MAX_EXTENT; 3]),
        Solid::cuboid([MAX_EXTENT, 300, 20]),
        Solid::cuboid([1; 3]),
    ] {
        for solid in [solid.clone(), solid.inside_out()] {
            for i in 0..seeded::cases(1500) {
                let distance = match i % 3 {
                    0 => random.i32(0..=Pose::MAX_DISTANCE),
                    1 => length(&mut random) * 2,
                    _ => random.i32(0..2 * unit),
                };
                let pose = pose(&mut random, distance);
                solid.with_renderer(&mut memory, |renderer| {
                    let mut page = PlanarBuffer::new();
                    let stats = renderer
                        .draw(&pose, RenderOptions::default(), &mut page)
                        .stats;
                    assert_eq!(stats.dropped, 0, "{pose:?}");
                });
            }
        }
    }
}

/// Runs `cases` cases of a mix; panics with a test to paste.
fn sweep(mix: SolidMix, cases: usize) -> SolidCounts {
    let seed = seeded::generator().get_seed();
    let mut checker = SolidChecker::default();
    let mut compared = SolidCounts::default();
    for number in 0..seeded::cases(cases) as u64 {
        let case = mix.case(seed, number);
        compared += checker.case(&case).unwrap_or_else(|wrong| {
            let from = format_args!("mix {mix:?}, seed {seed}, case {number}");
            panic!("\n{}", case.source(&wrong, from));
        });
    }
    println!("{}: {compared:?}", mix.name());
    compared
}

#[test]
fn from_inside_a_box_each_pixel_is_written_once() {
    sweep(SolidMix::InBox, 3000);
}

#[test]
fn from_inside_the_ball_each_pixel_is_written_once() {
    sweep(SolidMix::InBall, 1000);
}

#[test]
fn from_inside_a_crag_each_pixel_is_written_once() {
    sweep(SolidMix::InCrag, 3000);
}

#[test]
fn closed_solids_have_no_gap_from_outside_and_no_double_but_in_a_fold() {
    for mix in [SolidMix::Ball, SolidMix::Cube, SolidMix::Octahedron] {
        let compared = sweep(mix, 300);
        assert!(!seeded::is_whole() || compared.pixels > 200_000);
        // About one in ten thousand poses has a fold that covers a pixel.
        assert!(compared.folds <= 3);
    }
}

#[test]
fn cut_faces_are_where_lines_of_sight_meet_them() {
    let SolidCounts {
        cut: [near, guard],
        cut_away,
        changed,
        ..
    } = sweep(SolidMix::Anywhere, 400);
    assert!(
        !seeded::is_whole() || near > 400 && guard > 200 && cut_away > 200_000 && changed > 400
    );
}

#[test]
fn the_eye_may_come_to_a_256th_of_a_unit_from_a_face() {
    let mut memory = in_place::boxed!(RenderMemory);
    let unit = 1 << 16;
    let cube = Solid::cuboid([unit; 3]);
    let mut count = PixelCounter::default();
    let mut looking_on = |above: i32, roll: u32| {
        let pose = Pose {
            yaw: 0,
            pitch: 0,
            roll,
            distance: unit + above,
        };
        let stats = count.draw(&mut memory, &cube, &pose);
        assert_eq!(stats.dropped, 0);
        (stats.polygons, count.gaps_and_doubles())
    };
    for roll in [0, 1, 1 << 28, 1 << 29, 0xABCD_EF01] {
        for above in [128, 129, 256, 257, 512, unit / 256 * 3] {
            assert_eq!(looking_on(above, roll), (1, (0, 0)), "{above} above");
        }
        // A face nearer than the near plane is cut away whole.
        assert_eq!(looking_on(127, roll), (0, (WIDTH * HEIGHT, 0)));
    }
}

#[test]
fn beyond_the_limits_all_is_dropped_and_counted() {
    let mut memory = in_place::boxed!(RenderMemory);
    let cube = Solid::cuboid([1 << 16; 3]);
    let mut count = PixelCounter::default();
    for (distance, dropped) in [
        (-1, 6),
        (i32::MIN, 6),
        (0, 0),
        (1, 0),
        (Pose::MAX_DISTANCE - 1, 0),
        (Pose::MAX_DISTANCE, 0),
        (Pose::MAX_DISTANCE + 1, 6),
        (i32::MAX, 6),
    ] {
        let pose = Pose {
            distance,
            ..Pose::at_tick(0)
        };
        let stats = count.draw(&mut memory, &cube, &pose);
        assert_eq!(stats.dropped, dropped, "distance {distance}");
        let (gaps, doubles) = count.gaps_and_doubles();
        // At the largest distance the cube is some four pixels wide; from inside it shows no face.
        let empty = dropped > 0 || distance < 2;
        assert_eq!((gaps == WIDTH * HEIGHT, doubles), (empty, 0));
    }
}

/// Such a face is not legal, but it must do no harm.
#[test]
fn a_zigzag_that_clipping_gives_too_many_corners_is_dropped_and_counted() {
    let mut memory = in_place::boxed!(RenderMemory);
    for (corners, dropped) in [(3, 0), (5, 0), (MAX_CORNERS, 1)] {
        let vertices: Vec<Vec3> = (0..corners as i32)
            .map(|i| {
                [
                    if i % 2 == 0 { -1 } else { 1 } * MAX_EXTENT,
                    i * 99,
                    1 << 12,
                ]
            })
            .collect();
        let face: Vec<u16> = (0..corners as u16).collect();
        let solid = Solid::new(&vertices, &[&face]);
        let straight = Pose {
            yaw: 0,
            pitch: 0,
            roll: 0,
            distance: 0,
        };
        let stats = PixelCounter::default().draw(&mut memory, &solid, &straight);
        assert_eq!(stats.dropped, dropped, "{corners} corners");
    }
}

#[test]
fn meshes_that_clipping_has_no_room_for_are_refused() {
    let ring = |corners: u16| {
        let vertices = vec![[0; 3]; usize::from(corners)];
        Solid::new(&vertices, &[&(0..corners).collect::<Vec<_>>()])
    };
    let far = |extent: i32| Solid::cuboid([extent, 1, 1]);
    let accepted = |solid: &Solid| {
        let solid = solid.clone();
        std::panic::catch_unwind(move || {
            let mut memory = in_place::boxed!(RenderMemory);
            solid.with_renderer(&mut memory, |_| ());
        })
        .is_ok()
    };
    let corners = MAX_CORNERS as u16;
    for (solid, legal) in [
        (ring(2), false),
        (ring(3), true),
        (ring(corners - 1), true),
        (ring(corners), true),
        (ring(corners + 1), false),
        (far(MAX_EXTENT - 1), true),
        (far(MAX_EXTENT), true),
        (far(MAX_EXTENT + 1), false),
    ] {
        assert_eq!(accepted(&solid), legal, "{solid:?}");
    }
}
