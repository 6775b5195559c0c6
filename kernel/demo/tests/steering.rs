//! A running demo on the emulated VGA, steered by keys and commands, and drawn again from its log.

mod common;

use common::{ask, carry_out};
use demo::{Demo, KEYS};
use protocol::Action;
use vga::Vga;

/// Returns what is shown: checksums of the bytes, and the frame's name.
fn evidence(demo: &mut Demo<'_, Vga>, tick: u32) -> Vec<String> {
    let mut evidence = carry_out(demo, "checksums", tick);
    // The same frame may be on another page.
    let (_, crc) = evidence[0].split_once(" crc ").unwrap();
    evidence[0] = crc.to_string();
    let state = carry_out(demo, "state", tick);
    let named = |line: &&String| {
        let names = ["scene", "mapper", "frame", "motion", "drawn"];
        names.contains(&line.split(' ').next().unwrap())
    };
    evidence.extend(state.iter().filter(named).cloned());
    evidence
}

/// Scan codes of the keys that these tests press.
const M: u8 = 0x32;
const LEFT: [u8; 2] = [0xE0, 0x4B];
const PAGE_UP: [u8; 2] = [0xE0, 0x49];
const RELEASED: u8 = 0x80;

#[test]
fn a_log_gives_every_frame_again_byte_for_byte() {
    let mut random = seeded::generator();
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let (mut tick, mut frames) = (random.u32(..1000), Vec::new());
    for frame in 0..seeded::cases(80) {
        demo.present(tick, &mut |_| {});
        // Frames with an overlay differ; the frames after them must not.
        if frame / 10 % 2 == 0 {
            frames.push((tick, evidence(&mut demo, tick)));
        }
        if frame % 10 == 9 {
            let overlay = if frame < 40 { "help" } else { "info" };
            carry_out(&mut demo, &format!("steer {overlay}"), tick);
        }
        // Some changes come after the frame of their tick, and some before it.
        for _ in 0..random.usize(..4) {
            let action = Action::ALL[random.usize(..Action::ALL.len())];
            match random.u8(..8) {
                // A reset removes earlier changes from the log.
                _ if action == Action::Reset || action.is_overlay() => {}
                0 => LEFT
                    .iter()
                    .chain(&PAGE_UP)
                    .for_each(|&code| demo.key(code, tick)),
                1 => [M, M, M | RELEASED]
                    .iter()
                    .for_each(|&code| demo.key(code, tick)),
                2 => _ = carry_out(&mut demo, "mapper within-3/8", tick),
                3 if frame % 4 == 0 => _ = carry_out(&mut demo, "steer scene cube", tick),
                _ => _ = carry_out(&mut demo, &format!("steer {action}"), tick),
            }
            tick += random.u32(..3);
        }
        tick += 1;
    }
    let log = carry_out(&mut demo, "log", tick);
    println!("{log:#?}");
    let mut memory = common::memory();
    let mut second = Demo::new(&mut memory, Vga::new(), None).unwrap();
    for (demo, start) in [(&mut second, "hold"), (&mut demo, "hold")] {
        carry_out(demo, start, 0);
        for line in &log {
            carry_out(demo, line, 0);
        }
        assert_eq!(carry_out(demo, "log", 0), log);
        // Any order gives the same frames.
        for _ in 0..seeded::cases(30) {
            let (tick, shown) = &frames[random.usize(..frames.len())];
            carry_out(demo, &format!("show at {tick}"), 0);
            assert_eq!(&evidence(demo, 0), shown, "at {tick}");
        }
    }
    // A frame's name, including its motion, is enough to draw the frame.
    for (tick, shown) in &frames {
        carry_out(&mut demo, &format!("show at {tick}"), 0);
        let [_, _, scene, mapper, frame, motion, _] = &shown[..] else {
            panic!("{shown:?}")
        };
        carry_out(&mut second, scene, 0);
        carry_out(&mut second, mapper, 0);
        let frame = frame.replacen("frame", "show", 1);
        let motion = Some(motion).filter(|motion| *motion != "motion none");
        let motion = motion.map_or(String::new(), |motion| format!(" {motion}"));
        carry_out(&mut second, &format!("{frame}{motion}"), 0);
        assert_eq!(&evidence(&mut second, 0), shown);
    }
}

#[test]
fn a_running_demo_can_be_stopped_at_an_earlier_tick() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    demo.present(10, &mut |_| {});
    carry_out(&mut demo, "steer nearer", 10);
    demo.present(12, &mut |_| {});
    let shown = evidence(&mut demo, 12);
    carry_out(&mut demo, "steer next-mapper", 12);
    demo.present(13, &mut |_| {});
    carry_out(&mut demo, "show at 12", 13);
    assert_eq!(evidence(&mut demo, 13), shown);
    assert_eq!(
        carry_out(&mut demo, "log", 13)[3..],
        ["steer 11 nearer", "steer 13 next-mapper"]
    );
    // A demo that runs again has the scene's own motion, and the settings of the last frame.
    carry_out(&mut demo, "run", 20);
    demo.present(20, &mut |_| {});
    assert_eq!(
        carry_out(&mut demo, "state", 20)[1..5],
        ["scene ball", "mapper shifts", "order polygons", "frame 20",]
    );
    assert_eq!(carry_out(&mut demo, "log", 20).len(), 3);
}

#[test]
fn illegal_steering_is_refused_with_a_reason() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let refused = |demo: &mut Demo<'_, Vga>, line, reason| {
        let answer = ask(demo, line, 3);
        assert!(
            answer.len() == 1 && answer[0].starts_with("error ") && answer[0].contains(reason),
            "{line}: {answer:?}"
        );
    };
    demo.present(3, &mut |_| {});
    refused(&mut demo, "steer 3 stop", "leave out the tick");
    refused(&mut demo, "steer mapper none", "unknown mapper 'none'");
    refused(&mut demo, "mapper none", "unknown mapper 'none'");
    carry_out(&mut demo, "hold", 3);
    refused(&mut demo, "steer 5 help", "has no overlay");
    refused(&mut demo, "steer info", "has no overlay");
    refused(&mut demo, "steer stop", "use 'steer TICK CHANGE'");
    refused(&mut demo, "steer 5 scene none", "unknown scene 'none'");
    carry_out(&mut demo, "steer 5 stop", 3);
    refused(&mut demo, "steer 4 stop", "use 5 or a later tick");
    // A held demo ignores keys.
    demo.key(M, 3);
    assert_eq!(carry_out(&mut demo, "log", 3)[3..], ["steer 5 stop"]);
    for tick in 6..6 + 1023 {
        carry_out(&mut demo, &format!("steer {tick} yaw-left"), 3);
    }
    refused(
        &mut demo,
        "steer 9999 stop",
        "the log is full with 1024 changes",
    );
}

/// Actions still work when the log is full; a reset empties the log.
#[test]
fn a_full_log_counts_lost_changes_and_the_demo_still_obeys() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    for tick in 0..1027 {
        carry_out(&mut demo, "steer next-order", tick);
    }
    let log = carry_out(&mut demo, "log", 1027);
    assert_eq!(
        (log.len(), log.last().unwrap().as_str()),
        (3 + 1024 + 1, "lost 3")
    );
    let order = &carry_out(&mut demo, "state", 1027)[3];
    assert_eq!(
        order, "order planes",
        "1027 is one more than a multiple of three"
    );
    let answer = ask(&mut demo, "show at 1027", 1027);
    assert_eq!(
        answer,
        ["error the log was full and lacks changes before tick 1027; use an earlier tick"]
    );
    carry_out(&mut demo, "steer reset", 1028);
    let log = carry_out(&mut demo, "log", 1028);
    assert_eq!(log, ["scene ball", "mapper shifts", "order polygons"]);
    carry_out(&mut demo, "show at 1028", 1028);
}

/// The table in `docs/steering.md` lists the key map.
#[test]
fn the_documentation_lists_every_key() {
    let page = include_str!("../../../docs/steering.md");
    let rows = KEYS
        .iter()
        .map(|key| format!("| {} | `{}` | {} |\n", key.name, key.action, key.about));
    let table: String = rows.collect();
    assert!(
        page.contains(&table),
        "docs/steering.md should have this table:\n{table}"
    );
}

#[test]
fn the_keys_command_lists_every_key() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let keys = carry_out(&mut demo, "keys", 0);
    assert_eq!(keys.len(), KEYS.len());
    assert!(
        keys.contains(&"Space pause: pause and resume".to_string()),
        "{keys:?}"
    );
    demo.key(M, 0);
    demo.set_lost_keys(2);
    assert_eq!(
        carry_out(&mut demo, "counts", 0).last().unwrap(),
        "keys taken 1 lost 2"
    );
}

/// The overlay needs four writes to Map Mask, and no write if the frame is drawn in RAM first.
#[test]
fn an_overlay_is_counted_separately_and_leaves_no_trace() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let mut tick = 0;
    let mut present = |demo: &mut Demo<'_, Vga>| {
        tick += 1;
        demo.present(tick, &mut |_| {});
        demo.add_frame_time(2500);
        let counts = carry_out(demo, "counts", tick);
        let [draw, overlay] = ["draw ", "overlay "].map(|purpose| {
            counts
                .iter()
                .find_map(|line| line.strip_prefix(purpose))
                .unwrap()
                .to_string()
        });
        (draw, overlay)
    };
    const NONE: &str = "ports 0 map-mask 0 stores 0 bytes 0";
    // A page that was not drawn on before is erased whole.
    for _ in 0..3 {
        present(&mut demo);
    }
    let (bare, overlay) = present(&mut demo);
    assert_eq!(overlay, NONE);
    for name in ["help", "info", "hint"] {
        carry_out(&mut demo, &format!("steer {name}"), 1);
        for _ in 0..4 {
            let (draw, overlay) = present(&mut demo);
            assert!(
                overlay.starts_with("ports 4 map-mask 4 stores "),
                "{name}: {overlay}"
            );
            // A tick later the ball has a few more or fewer pixels and columns.
            let columns = |text: &str| text.split(' ').nth(1).unwrap().parse::<i32>().unwrap();
            assert!(
                (columns(&draw) - columns(&bare)).abs() < 100,
                "{draw}, not {bare}"
            );
        }
        carry_out(&mut demo, "order buffer", 1);
        let (draw, overlay) = present(&mut demo);
        assert!(
            draw.starts_with("ports 4 map-mask 4 ") && overlay == NONE,
            "{draw}; {overlay}"
        );
        carry_out(&mut demo, "order polygons", 1);
        if name != "hint" {
            carry_out(&mut demo, &format!("steer {name}"), 1);
            assert_eq!(present(&mut demo).1, NONE, "{name}");
        }
    }
    // The hint ends 300 ticks after its action.
    let hint_end = (0..400).find(|_| present(&mut demo).1 == NONE).unwrap();
    assert!((250..300).contains(&hint_end), "{hint_end}");
}

/// Each panel has the pixels that the whole frame has there, in every order. The error of the exact mapper
/// is the same everywhere; the errors of other mappers are not.
#[test]
fn a_split_view_shows_the_same_part_three_times() {
    const LINES: usize = 200;
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let mut tick = 0;
    let mut pixels = |demo: &mut Demo<'_, Vga>| {
        tick += 1;
        demo.present(tick, &mut |_| {});
        assert_eq!(demo.bus().take_faults(), []);
        demo.bus().finish_frame();
        demo.bus().page().unwrap().pixels
    };
    let panel = |pixels: &[u8], from: usize| -> Vec<u8> {
        let line = |y: usize| pixels[y * 320 + from..][..104].to_vec();
        (0..LINES).flat_map(line).collect()
    };
    carry_out(&mut demo, "scene tilted", 0);
    carry_out(&mut demo, "steer pause", 0);
    let sky = pixels(&mut demo)[0];
    carry_out(&mut demo, "mapper exact", 0);
    let exact = panel(&pixels(&mut demo), 108);
    for order in ["polygons", "planes", "buffer"] {
        carry_out(&mut demo, &format!("order {order}"), 0);
        for mapper in [
            "shifts",
            "row-multiply",
            "row-passes",
            "free-direction",
            "row-or-column",
            "exact",
        ] {
            carry_out(&mut demo, &format!("mapper {mapper}"), 0);
            let whole = panel(&pixels(&mut demo), 108);
            carry_out(&mut demo, "steer split", 0);
            let split = pixels(&mut demo);
            assert!(panel(&split, 0) == whole, "{mapper} {order}");
            assert!(panel(&split, 108) == exact, "exact beside {mapper} {order}");
            let mut errors = panel(&split, 216);
            errors.sort();
            errors.dedup();
            let same = errors
                .iter()
                .filter(|colour| !whole.contains(colour))
                .count();
            // The board is slanted so that the errors of the other mappers are nearly zero too.
            match mapper {
                "exact" => assert_eq!(same, 1, "{order}: {errors:?}"),
                "shifts" | "row-multiply" => assert!(same > 4, "{mapper} {order}: {errors:?}"),
                _ => {}
            }
            carry_out(&mut demo, "steer split", 0);
            assert!(
                panel(&pixels(&mut demo), 108) == whole,
                "{mapper} {order} again"
            );
            assert_eq!(pixels(&mut demo)[0], sky);
        }
    }
}

/// Quality is reduced during motion only, in the log's frames as in the demo's own.
#[test]
fn quality_is_reduced_during_motion_only() {
    let mut memory = common::memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let motion = |evidence: &[String]| evidence[5].clone();
    let present = |demo: &mut Demo<'_, Vga>, tick| {
        demo.present(tick, &mut |_| {});
        evidence(demo, tick)
    };
    for line in ["scene cube", "mapper exact"] {
        carry_out(&mut demo, line, 0);
    }
    let full = present(&mut demo, 100);
    carry_out(&mut demo, "steer quality", 100);
    let moving = present(&mut demo, 101);
    carry_out(&mut demo, "steer pause", 101);
    let paused = present(&mut demo, 102);
    assert_eq!(present(&mut demo, 200)[0], paused[0]);
    carry_out(&mut demo, "mapper shifts", 200);
    carry_out(&mut demo, "steer pause", 200);
    let affine = present(&mut demo, 201);
    const NONE: &str = "motion none";
    let motions = [&full, &moving, &paused, &affine].map(|evidence| motion(evidence));
    let [_, by, ..] = &motions;
    assert!(by.starts_with("motion ") && by != NONE, "{by}");
    assert_eq!(motions, [NONE, by, NONE, NONE]);

    let log = carry_out(&mut demo, "log", 201);
    carry_out(&mut demo, "hold", 0);
    for line in &log {
        carry_out(&mut demo, line, 0);
    }
    for (tick, shown) in [(100, &full), (101, &moving), (102, &paused), (201, &affine)] {
        carry_out(&mut demo, &format!("show at {tick}"), 0);
        assert_eq!(&evidence(&mut demo, 0), shown, "at {tick}");
    }
    // A frame by its name has full quality, unless the name includes a motion.
    carry_out(&mut demo, "mapper exact", 0);
    carry_out(&mut demo, "show 101", 0);
    let named = evidence(&mut demo, 0);
    assert_eq!(motion(&named), NONE);
    assert_ne!(named[0], moving[0]);
    carry_out(&mut demo, &format!("show 101 {by}"), 0);
    assert_eq!(evidence(&mut demo, 0), moving);
    // A motion that reduces no face's quality is not part of the name.
    let still = format!("show 101 motion{}", " 00000000".repeat(4));
    for name in [still.as_str(), "mapper shifts"] {
        carry_out(&mut demo, name, 0);
    }
    assert_eq!(motion(&evidence(&mut demo, 0)), NONE);
    carry_out(&mut demo, &format!("show 101 {by}"), 0);
    assert_eq!(motion(&evidence(&mut demo, 0)), NONE);
    let answer = ask(&mut demo, "show 101 motion 0 0 0 80000000", 0);
    assert!(
        answer[0].starts_with("error the motion moves the distance "),
        "{answer:?}"
    );
}
