//! Every fault, caused by an access that would blank or garble the screen of a real VGA, or that a real VGA
//! would drop.

use modex::registers::*;
use modex::{Bus, Destination, HEIGHT, ModeX, Purpose, STRIDE};
use vga::Vga;

const BLACK: [[u8; 3]; 256] = [[0; 3]; 256];

/// Returns a card in Mode X, its first frame begun.
fn card() -> Vga {
    let mut vga = Vga::new();
    ModeX::set(&mut vga, &BLACK).unwrap();
    vga.finish_frame();
    assert_eq!(vga.take_faults(), []);
    vga
}

fn word(index: u8, value: u8) -> u16 {
    u16::from_le_bytes([index, value])
}

/// Runs `wrong` on a card in Mode X; it must cause exactly this fault, by this access.
#[track_caller]
fn faults(name: &str, access: &str, wrong: impl FnOnce(&mut Vga)) {
    let mut vga = card();
    wrong(&mut vga);
    let faults = vga.take_faults();
    let messages: Vec<_> = faults.iter().map(|fault| fault.to_string()).collect();
    assert_eq!(faults.len(), 1, "{messages:?}");
    assert_eq!(faults[0].name, name);
    assert!(messages[0].contains(access), "{messages:?}");
}

#[test]
fn registers_ports_and_values_that_no_scene_uses_are_faults() {
    let unused = "unused value";
    faults(unused, "out 3C4h, 0204h", |v| {
        v.out16(SEQUENCER, word(4, 0x02))
    });
    faults(unused, "out 3C4h, 0E04h", |v| {
        v.out16(SEQUENCER, word(4, 0x0E))
    });
    faults(unused, "out 3C4h, 0002h", |v| {
        v.out16(SEQUENCER, word(2, 0x00))
    });
    faults(unused, "SR3 = 01h", |v| v.out16(SEQUENCER, word(3, 0x01)));
    faults("unused register", "SR6", |v| {
        v.out16(SEQUENCER, word(6, 0x12))
    });
    faults(unused, "GR3 = 08h", |v| v.out16(GRAPHICS, word(3, 0x08)));
    faults(unused, "GR5 = 01h", |v| v.out16(GRAPHICS, word(5, 0x01)));
    faults(unused, "GR8 = F0h", |v| v.out16(GRAPHICS, word(8, 0xF0)));
    faults("unused register", "GR9", |v| v.out16(GRAPHICS, word(9, 0)));
    faults(
        "wrong timing",
        "80 bytes needed, the write gives 160",
        |v| {
            v.out16(CRTC, word(0x13, 0x50));
        },
    );
    faults(unused, "CR17 = C3h", |v| v.out16(CRTC, word(0x17, 0xC3)));
    faults(
        "wrong timing",
        "492 lines needed, the write gives 493",
        |v| {
            v.out16(CRTC, word(0x11, 0xAD));
        },
    );
    faults(
        "wrong timing",
        "CR06, CR07 vertical total: 527 lines needed, the write gives 525",
        |v| {
            v.out16(CRTC, word(0x11, 0x2C));
            v.out16(CRTC, word(0x06, 0x0B));
        },
    );
    faults(unused, "bits 7 and 6: the polarity of the syncs", |v| {
        v.out16(SEQUENCER, word(RESET, 0x01));
        v.out8(MISC_WRITE, 0x63);
        v.out16(SEQUENCER, word(RESET, 0x03));
    });
    faults("unused register", "CR19", |v| v.out16(CRTC, word(0x19, 0)));
    for address in [0x15, 0x50, 0x90] {
        faults("unused register", &format!("AR{address:02X}"), |v| {
            v.in8(INPUT_STATUS_1);
            v.out8(ATTRIBUTE, address);
        });
    }
    faults(unused, "PEL Mask", |v| v.out8(PEL_MASK, 0x0F));
    faults("unused port", "3C3", |v| v.out8(0x3C3, 1));
    faults("unused port", "word write to 3C0", |v| {
        v.out16(ATTRIBUTE, 0x2020)
    });
    faults("unused port", "000", |v| {
        v.in8(0);
    });
    faults(unused, "DISPI", |v| v.out16(DISPI_DATA, 1));
}

#[test]
fn accesses_that_a_card_drops_or_garbles_are_faults() {
    faults("write to a protected register", "CR00", |v| {
        v.out16(CRTC, word(0, 0x60));
        assert_eq!(v.in8(CRTC + 1), 0x5F);
    });
    faults("palette is closed", "AR0", |v| {
        v.in8(INPUT_STATUS_1);
        v.out8(ATTRIBUTE, PALETTE_ADDRESS_SOURCE);
        v.out8(ATTRIBUTE, 0);
    });
    faults("DAC value is wider than 6 bits", "41h", |v| {
        v.out8(PEL_WRITE, 7);
        v.out8(PEL_DATA, 0x41);
        v.out8(PEL_READ, 7);
        assert_eq!(v.in8(PEL_DATA), 0x01);
    });
    faults("DAC is not in read mode", "in 3C9h", |v| {
        v.out8(PEL_WRITE, 7);
        v.in8(PEL_DATA);
    });
    faults("DAC is not in write mode", "out 3C9h", |v| {
        v.out8(PEL_READ, 7);
        v.out8(PEL_DATA, 0);
    });
    faults("unaligned store", "A000:4B04", |v| v.store64(0x4B04, 0));
    let mut vga = card();
    vga.lane::<STRIDE>(0xFFC0, 2, |column| column.fill(|| 0));
    assert_eq!(vga.take_faults()[0].name, "store past the window");
    faults("address past the last page", "A000:E100", |v| {
        v.purpose(Purpose::Draw);
        v.lane::<STRIDE>(0xE100, 1, |column| column.fill(|| 1));
    });
    faults("store to a displayed page", "is on the screen", |v| {
        v.purpose(Purpose::Draw);
        v.lane::<STRIDE>(0x4AFF, 1, |column| column.fill(|| 1));
    });
    faults("store to a displayed page", "will be on the screen", |v| {
        v.out16(CRTC, word(START_ADDRESS_HIGH, 0x4B));
        v.purpose(Purpose::Erase);
        v.lane::<STRIDE>(0x4B00, 1, |column| column.fill(|| 1));
    });
    faults(
        "start address is split over a retrace",
        "out 3D4h, 500Dh",
        |v| {
            v.out16(CRTC, word(START_ADDRESS_HIGH, 0x4B));
            v.finish_frame();
            v.out16(CRTC, word(START_ADDRESS_LOW, 0x50));
        },
    );
}

#[test]
fn accesses_before_the_mode_is_set_are_faults() {
    let names = |wrong: &dyn Fn(&mut Vga)| -> Vec<&'static str> {
        let mut vga = Vga::new();
        wrong(&mut vga);
        vga.take_faults()
            .into_iter()
            .map(|fault| fault.name)
            .collect()
    };
    // The linear mode that the boot loader left.
    assert_eq!(
        names(&|v| v.out8(MISC_WRITE, 0xE3))[0],
        "card is in a linear mode"
    );
    let leave = |v: &mut Vga| {
        v.out16(DISPI_INDEX, DISPI_ENABLE);
        v.out16(DISPI_DATA, 0);
    };
    let after = |wrong: &dyn Fn(&mut Vga)| {
        names(&|v| {
            leave(v);
            wrong(v);
        })
    };
    assert_eq!(
        after(&|v| v.out8(MISC_WRITE, 0xE3)),
        ["Miscellaneous Output changed without reset"]
    );
    assert_eq!(after(&|v| v.out8(ATTRIBUTE, 0)), ["flip-flop is unknown"]);
    assert_eq!(
        after(&|v| v.out8(PEL_DATA, 0)),
        ["DAC is not in write mode"]
    );
    // The BIOS leaves the protection on.
    assert_eq!(
        after(&|v| v.out16(CRTC, word(0, 0x5F))),
        ["write to a protected register"]
    );
    assert_eq!(
        after(&|v| {
            v.in8(MISC_READ);
        }),
        ["read of a register never written"]
    );
    assert_eq!(
        after(&|v| {
            v.out8(PEL_READ, 0);
            v.in8(PEL_DATA);
        }),
        ["colour was never written"]
    );
    assert_eq!(after(&|v| v.store64(0, 0))[0], "memory is not unchained");
    assert_eq!(
        after(&|v| {
            v.out16(SEQUENCER, word(4, 0x06));
            v.lane::<STRIDE>(0, 1, |column| column.fill(|| 0));
        }),
        ["register was never written"]
    );
}

#[test]
fn a_store_is_a_fault_if_the_window_is_not_at_a0000h() {
    let mut vga = card();
    vga.out16(GRAPHICS, word(6, 0x0D));
    vga.lane::<STRIDE>(0x5000, 1, |column| column.fill(|| 1));
    let names: Vec<_> = vga.take_faults().iter().map(|fault| fault.name).collect();
    assert_eq!(names, ["unused value", "window is not at A0000h"]);
}

#[test]
fn legal_accesses_that_resemble_faults_are_accepted() {
    let mut vga = card();
    // A displayed page may be written while the screen is off.
    vga.lane::<STRIDE>(0, 1, |column| column.fill(|| 1));
    vga.out16(SEQUENCER, word(CLOCKING_MODE, 0x21));
    vga.purpose(Purpose::Draw);
    vga.lane::<STRIDE>(0, 1, |column| column.fill(|| 1));
    // PAS closes the palette registers and no other registers.
    vga.in8(INPUT_STATUS_1);
    vga.out8(ATTRIBUTE, PALETTE_ADDRESS_SOURCE | 0x10);
    vga.out8(ATTRIBUTE, 0x41);
    // Each block keeps its own index.
    vga.out8(SEQUENCER, 4);
    vga.out8(GRAPHICS, 5);
    vga.out8(CRTC, 0x13);
    let read = [SEQUENCER, GRAPHICS, CRTC].map(|port| vga.in8(port + 1));
    assert_eq!(read, [0x06, 0x40, 0x28]);
    assert_eq!(vga.take_faults(), []);
}

#[test]
fn a_blank_or_garbled_screen_is_a_fault_of_the_scan_out() {
    let shown = |wrong: &dyn Fn(&mut Vga)| {
        let mut vga = card();
        wrong(&mut vga);
        vga.take_faults();
        vga.scan_out().map_err(|fault| fault.name).err()
    };
    assert_eq!(shown(&|_| ()), None);
    assert_eq!(
        shown(&|v| v.out16(SEQUENCER, word(RESET, 0x01))),
        Some("sequencer is in reset")
    );
    assert_eq!(
        shown(&|v| v.out16(SEQUENCER, word(CLOCKING_MODE, 0x21))),
        Some("screen is off")
    );
    assert_eq!(
        shown(&|v| v.out16(SEQUENCER, word(4, 0x0E))),
        Some("memory is not unchained")
    );
    assert_eq!(
        shown(&|v| {
            v.in8(INPUT_STATUS_1);
            v.out8(ATTRIBUTE, 0x10);
        }),
        Some("PAS is 0")
    );
    assert_eq!(
        shown(&|v| v.out16(GRAPHICS, word(6, 0x04))),
        Some("AR10 and GR6 disagree about graphics")
    );
    let switched_on = Vga::new().scan_out();
    assert_eq!(switched_on.unwrap_err().name, "sequencer is in reset");
}

#[test]
fn a_start_address_is_shown_from_the_next_retrace_on() {
    let mut vga = Vga::new();
    let mut palette = BLACK;
    palette[1] = [63, 0, 0];
    let mut card = ModeX::set(&mut vga, &palette).unwrap();
    card.bus().finish_frame();
    let red = [1; HEIGHT];
    card.begin(&red).column(0, 0, 1, |column| column.fill(|| 0));
    card.flip();
    let colour = |vga: &Vga| vga.scan_out().unwrap().dots[2 * 640 + 10];
    assert_eq!(colour(card.bus()), [0, 0, 0]);
    card.settle();
    assert_eq!(colour(card.bus()), [63, 0, 0]);
}

#[test]
fn a_load_fills_the_latches_and_a_peek_does_not() {
    let mut vga = card();
    for plane in 0..4 {
        vga.out16(SEQUENCER, word(MAP_MASK, 1 << plane));
        vga.lane::<STRIDE>(0x5000, 1, |column| column.fill(|| 10 + plane));
    }
    for plane in 0..4 {
        vga.out16(GRAPHICS, word(4, plane));
        assert_eq!(vga.load8(0x5000), 10 + plane);
        assert_eq!(vga.peek(usize::from(plane), 0x5000), 10 + plane);
    }
}

#[test]
#[should_panic(expected = "unused port")]
fn a_fault_that_no_test_takes_panics_when_the_card_is_dropped() {
    card().out8(0x3C3, 1);
}
