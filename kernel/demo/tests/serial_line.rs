//! Effects of the serial line on a demo, and of commands on the card.

mod asked;

use asked::{ask, done, memory};
use demo::Show;
use modex::Purpose;
use modex::registers::MISC_WRITE;
use protocol::Reception;
use vga::Vga;

/// Returns how often the card's mode was set.
fn mode_sets(show: &mut Show<'_, Vga>) -> u64 {
    show.bus().port_writes(Purpose::Setup, MISC_WRITE, None)
}

#[test]
fn each_command_resets_the_card_once_at_most() {
    let mut memory = memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let mut before = mode_sets(&mut show);
    assert_eq!(before, 1);
    for (line, resets) in [
        ("steer next-scene", 1),
        ("steer faster", 0),
        ("hold", 1),
        ("scene cube", 1),
        ("show 3", 0),
        ("scene cube", 1),
        ("mapper exact", 0),
        ("hold", 1),
        ("steer 5 next-scene", 0),
        ("show at 9", 1),
        ("show at 10", 0),
        ("run", 0),
        ("scene knot", 1),
        ("show 7", 1),
    ] {
        done(&mut show, line, 0);
        let after = mode_sets(&mut show);
        assert_eq!(after - before, resets, "{line}");
        before = after;
    }
}

#[test]
fn a_line_with_a_lost_byte_is_not_carried_out() {
    let mut memory = memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    done(&mut show, "hold", 0);
    let mut said = Vec::new();
    // The bytes that arrive look like a command.
    for &byte in b"scene cu" {
        show.receive(byte, 0, &mut |line| said.push(line.to_string()));
    }
    show.damage();
    for &byte in b"be\rmapper exact\r" {
        show.receive(byte, 0, &mut |line| said.push(line.to_string()));
    }
    let refused = "error a line with bytes that were lost or damaged on the wire";
    assert_eq!(said, [refused, "ok mapper exact"]);
    let state = done(&mut show, "state", 0);
    assert!(state.contains(&"scene ball".into()), "{state:?}");
}

#[test]
fn what_went_wrong_on_the_line_is_in_the_state() {
    let mut memory = memory();
    let mut show = Show::new(&mut memory, Vga::new(), None).unwrap();
    let last = |show: &mut Show<'_, Vga>| ask(show, "state", 0).into_iter().rev().nth(1);
    let none = "serial overruns 0 damaged 0 full 0";
    assert_eq!(last(&mut show).as_deref(), Some(none));
    show.set_reception(Reception {
        overruns: 1,
        damaged: 2,
        full: 3,
    });
    let some = "serial overruns 1 damaged 2 full 3";
    assert_eq!(last(&mut show).as_deref(), Some(some));
}
