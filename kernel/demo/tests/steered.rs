//! A running demo on the emulated VGA, steered by keys and commands, and drawn again from its log.

mod asked;

use asked::{ask, done};
use demo::{KEYS, Show};
use protocol::Action;
use vga::Vga;

/// Returns what is shown: checksums of the bytes, and the frame's name.
fn evidence(show: &mut Show<'_, Vga>, tick: u32) -> Vec<String> {
    let mut evidence = done(show, "checksums", tick);
    // The same frame may be on another page.
    let (_, crc) = evidence[0].split_once(" crc ").unwrap();
    evidence[0] = crc.to_string();
    let state = done(show, "state", tick);
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
fn a_log_brings_back_every_frame_byte_for_byte() {
    let mut random = seeded::generator();
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let (mut tick, mut seen) = (random.u32(..1000), Vec::new());
    for frame in 0..seeded::cases(80) {
        show.present(tick, &mut |_| {});
        // Frames with an overlay differ; the frames after them must not.
        if frame / 10 % 2 == 0 {
            seen.push((tick, evidence(&mut show, tick)));
        }
        if frame % 10 == 9 {
            let overlay = if frame < 40 { "help" } else { "info" };
            done(&mut show, &format!("steer {overlay}"), tick);
        }
        // Some changes come after the frame of their tick, and some before it.
        for _ in 0..random.usize(..4) {
            let (_, action) = Action::ALL[random.usize(..Action::ALL.len())];
            match random.u8(..8) {
                // A reset removes earlier changes from the log.
                _ if action == Action::Reset || action.is_overlay() => {}
                0 => LEFT
                    .iter()
                    .chain(&PAGE_UP)
                    .for_each(|&code| show.key(code, tick)),
                1 => [M, M, M | RELEASED]
                    .iter()
                    .for_each(|&code| show.key(code, tick)),
                2 => _ = done(&mut show, "mapper within-3/8", tick),
                3 if frame % 4 == 0 => _ = done(&mut show, "steer scene cube", tick),
                _ => _ = done(&mut show, &format!("steer {action}"), tick),
            }
            tick += random.u32(..3);
        }
        tick += 1;
    }
    let log = done(&mut show, "log", tick);
    println!("{log:#?}");
    let mut memory = asked::memory();
    let mut twin = Show::new(&mut memory, Vga::new(), None).unwrap();
    for (show, start) in [(&mut twin, "hold"), (&mut show, "hold")] {
        done(show, start, 0);
        for line in &log {
            done(show, line, 0);
        }
        assert_eq!(done(show, "log", 0), log);
        // Any order gives the same frames.
        for _ in 0..seeded::cases(30) {
            let (tick, shown) = &seen[random.usize(..seen.len())];
            done(show, &format!("show at {tick}"), 0);
            assert_eq!(&evidence(show, 0), shown, "at {tick}");
        }
    }
    // A frame's name, including its motion, is enough to draw the frame.
    for (tick, shown) in &seen {
        done(&mut show, &format!("show at {tick}"), 0);
        let [_, _, scene, mapper, frame, motion, _] = &shown[..] else {
            panic!("{shown:?}")
        };
        done(&mut twin, scene, 0);
        done(&mut twin, mapper, 0);
        let frame = frame.replacen("frame", "show", 1);
        let motion = Some(motion).filter(|motion| *motion != "motion none");
        let motion = motion.map_or(String::new(), |motion| format!(" {motion}"));
        done(&mut twin, &format!("{frame}{motion}"), 0);
        assert_eq!(&evidence(&mut twin, 0), shown);
    }
}

#[test]
fn a_running_show_can_be_stopped_at_a_tick_of_its_own() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    show.present(10, &mut |_| {});
    done(&mut show, "steer nearer", 10);
    show.present(12, &mut |_| {});
    let shown = evidence(&mut show, 12);
    done(&mut show, "steer next-mapper", 12);
    show.present(13, &mut |_| {});
    done(&mut show, "show at 12", 13);
    assert_eq!(evidence(&mut show, 13), shown);
    assert_eq!(
        done(&mut show, "log", 13)[3..],
        ["steer 11 nearer", "steer 13 next-mapper"]
    );
    // A demo that runs again has the scene's own motion, and the settings of the last frame.
    done(&mut show, "run", 20);
    show.present(20, &mut |_| {});
    assert_eq!(
        done(&mut show, "state", 20)[1..5],
        ["scene ball", "mapper shifts", "order polygons", "frame 20",]
    );
    assert_eq!(done(&mut show, "log", 20).len(), 3);
}

#[test]
fn what_cannot_be_steered_is_told() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let refused = |show: &mut Show<'_, Vga>, line, reason| {
        let answer = ask(show, line, 3);
        assert!(
            answer.len() == 1 && answer[0].starts_with("error ") && answer[0].contains(reason),
            "{line}: {answer:?}"
        );
    };
    show.present(3, &mut |_| {});
    refused(&mut show, "steer 3 stop", "without a tick");
    refused(&mut show, "steer mapper none", "no mapper 'none'");
    refused(&mut show, "mapper none", "no mapper 'none'");
    done(&mut show, "hold", 3);
    refused(&mut show, "steer 5 help", "has no overlay");
    refused(&mut show, "steer info", "has no overlay");
    refused(&mut show, "steer stop", "a tick has to be said");
    refused(&mut show, "steer 5 scene none", "no scene 'none'");
    done(&mut show, "steer 5 stop", 3);
    refused(&mut show, "steer 4 stop", "the last one is 5");
    // A held demo ignores keys.
    show.key(M, 3);
    assert_eq!(done(&mut show, "log", 3)[3..], ["steer 5 stop"]);
    for tick in 6..6 + 1023 {
        done(&mut show, &format!("steer {tick} yaw-left"), 3);
    }
    refused(&mut show, "steer 9999 stop", "it holds 1024 changes");
}

/// Actions still work when the log is full; a reset empties the log.
#[test]
fn a_full_log_is_told_and_steers_on() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    for tick in 0..1027 {
        done(&mut show, "steer next-order", tick);
    }
    let log = done(&mut show, "log", 1027);
    assert_eq!(
        (log.len(), log.last().unwrap().as_str()),
        (3 + 1024 + 1, "lost 3")
    );
    let order = &done(&mut show, "state", 1027)[3];
    assert_eq!(
        order, "order planes",
        "1027 is one more than a multiple of three"
    );
    let answer = ask(&mut show, "show at 1027", 1027);
    assert_eq!(
        answer,
        ["error the log is full, and changes before tick 1027 are not in it"]
    );
    done(&mut show, "steer reset", 1028);
    let log = done(&mut show, "log", 1028);
    assert_eq!(log, ["scene ball", "mapper shifts", "order polygons"]);
    done(&mut show, "show at 1028", 1028);
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
fn keys_are_listed_with_what_they_do() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let keys = done(&mut show, "keys", 0);
    assert_eq!(keys.len(), KEYS.len());
    assert!(
        keys.contains(&"Space pause: pause and resume".to_string()),
        "{keys:?}"
    );
    show.key(M, 0);
    show.set_lost_keys(2);
    assert_eq!(
        done(&mut show, "counts", 0).last().unwrap(),
        "keys taken 1 lost 2"
    );
}

/// The overlay needs four writes to Map Mask, and none if the frame is drawn in RAM first.
#[test]
fn an_overlay_is_counted_apart_and_goes_again() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let mut tick = 0;
    let mut present = |show: &mut Show<'_, Vga>| {
        tick += 1;
        show.present(tick, &mut |_| {});
        show.took(2500);
        let counts = done(show, "counts", tick);
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
        present(&mut show);
    }
    let (bare, overlay) = present(&mut show);
    assert_eq!(overlay, NONE);
    for name in ["help", "info", "hint"] {
        done(&mut show, &format!("steer {name}"), 1);
        for _ in 0..4 {
            let (draw, overlay) = present(&mut show);
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
        done(&mut show, "order buffer", 1);
        let (draw, overlay) = present(&mut show);
        assert!(
            draw.starts_with("ports 4 map-mask 4 ") && overlay == NONE,
            "{draw}; {overlay}"
        );
        done(&mut show, "order polygons", 1);
        if name != "hint" {
            done(&mut show, &format!("steer {name}"), 1);
            assert_eq!(present(&mut show).1, NONE, "{name}");
        }
    }
    // The hint ends 300 ticks after its action.
    let gone = (0..400).find(|_| present(&mut show).1 == NONE).unwrap();
    assert!((250..300).contains(&gone), "{gone}");
}

/// Each window has the pixels that the whole frame has there, in every order. The error of the exact mapper
/// is the same everywhere; the errors of other mappers are not.
#[test]
fn a_split_view_shows_the_same_part_three_times() {
    const LINES: usize = 200;
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let mut tick = 0;
    let mut pixels = |show: &mut Show<'_, Vga>| {
        tick += 1;
        show.present(tick, &mut |_| {});
        assert_eq!(show.bus().take_faults(), []);
        show.bus().finish_frame();
        show.bus().page().unwrap().pixels
    };
    let part = |pixels: &[u8], from: usize| -> Vec<u8> {
        let line = |y: usize| pixels[y * 320 + from..][..104].to_vec();
        (0..LINES).flat_map(line).collect()
    };
    done(&mut show, "scene tilted", 0);
    done(&mut show, "steer pause", 0);
    let sky = pixels(&mut show)[0];
    done(&mut show, "mapper exact", 0);
    let exact = part(&pixels(&mut show), 108);
    for order in ["polygons", "planes", "buffer"] {
        done(&mut show, &format!("order {order}"), 0);
        for mapper in [
            "shifts",
            "row-multiply",
            "row-passes",
            "free-direction",
            "row-or-column",
            "exact",
        ] {
            done(&mut show, &format!("mapper {mapper}"), 0);
            let whole = part(&pixels(&mut show), 108);
            done(&mut show, "steer split", 0);
            let split = pixels(&mut show);
            assert!(part(&split, 0) == whole, "{mapper} {order}");
            assert!(part(&split, 108) == exact, "exact beside {mapper} {order}");
            let mut errors = part(&split, 216);
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
            done(&mut show, "steer split", 0);
            assert!(
                part(&pixels(&mut show), 108) == whole,
                "{mapper} {order} again"
            );
            assert_eq!(pixels(&mut show)[0], sky);
        }
    }
}

/// Quality is reduced during motion only, in the log's frames as in the demo's own.
#[test]
fn quality_is_lower_while_it_moves_and_only_then() {
    let mut memory = asked::memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let motion = |evidence: &[String]| evidence[5].clone();
    let present = |show: &mut Show<'_, Vga>, tick| {
        show.present(tick, &mut |_| {});
        evidence(show, tick)
    };
    for line in ["scene cube", "mapper exact"] {
        done(&mut show, line, 0);
    }
    let full = present(&mut show, 100);
    done(&mut show, "steer quality", 100);
    let moving = present(&mut show, 101);
    done(&mut show, "steer pause", 101);
    let standing = present(&mut show, 102);
    assert_eq!(present(&mut show, 200)[0], standing[0]);
    done(&mut show, "mapper shifts", 200);
    done(&mut show, "steer pause", 200);
    let affine = present(&mut show, 201);
    const NONE: &str = "motion none";
    let motions = [&full, &moving, &standing, &affine].map(|evidence| motion(evidence));
    let [_, by, ..] = &motions;
    assert!(by.starts_with("motion ") && by != NONE, "{by}");
    assert_eq!(motions, [NONE, by, NONE, NONE]);

    let log = done(&mut show, "log", 201);
    done(&mut show, "hold", 0);
    for line in &log {
        done(&mut show, line, 0);
    }
    for (tick, shown) in [
        (100, &full),
        (101, &moving),
        (102, &standing),
        (201, &affine),
    ] {
        done(&mut show, &format!("show at {tick}"), 0);
        assert_eq!(&evidence(&mut show, 0), shown, "at {tick}");
    }
    // A frame by its name has full quality, unless the name includes a motion.
    done(&mut show, "mapper exact", 0);
    done(&mut show, "show 101", 0);
    let named = evidence(&mut show, 0);
    assert_eq!(motion(&named), NONE);
    assert_ne!(named[0], moving[0]);
    done(&mut show, &format!("show 101 {by}"), 0);
    assert_eq!(evidence(&mut show, 0), moving);
    // A motion that reduces no face's quality is not part of the name.
    let still = format!("show 101 motion{}", " 00000000".repeat(4));
    for name in [still.as_str(), "mapper shifts"] {
        done(&mut show, name, 0);
    }
    assert_eq!(motion(&evidence(&mut show, 0)), NONE);
    done(&mut show, &format!("show 101 {by}"), 0);
    assert_eq!(motion(&evidence(&mut show, 0)), NONE);
    let answer = ask(&mut show, "show 101 motion 0 0 0 80000000", 0);
    assert!(
        answer[0].starts_with("error this motion leaves the legal distances"),
        "{answer:?}"
    );
}
