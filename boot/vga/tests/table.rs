//! The driver's register table against the emulated VGA's own values: every wrong bit is found.

use modex::registers::*;
use modex::{Bus, Lane, ModeX};
use vga::{Access, Vga};

/// An emulated VGA for a driver whose table has one wrong bit. A value of the table arrives with that bit
/// changed, and a read changes the bit back.
struct WrongBitVga {
    vga: Vga,
    block: &'static str,
    index: u8,
    right: u8,
    bit: u8,
    /// The register holds the wrong value.
    wrong: bool,
    /// The table's value was written.
    written: bool,
    /// The index that each index port was given last, and the attribute controller's flip-flop.
    selected: [u8; 4],
    data: bool,
}

/// The index ports, by their blocks' names.
const PORTS: [(&str, u16); 4] = [
    ("sequencer", SEQUENCER),
    ("crtc", CRTC),
    ("graphics", GRAPHICS),
    ("attribute", ATTRIBUTE),
];

impl WrongBitVga {
    fn write(&mut self, block: &str, index: u8, value: u8) -> u8 {
        if (block, index) != (self.block, self.index) {
            return value;
        }
        // Later the driver may write the same value for another reason.
        self.wrong = value == self.right && !self.written;
        self.written |= self.wrong;
        if self.wrong { value ^ self.bit } else { value }
    }

    fn read(&self, block: &str, index: u8, value: u8) -> u8 {
        let wrong = self.wrong && (block, index) == (self.block, self.index);
        if wrong { value ^ self.bit } else { value }
    }
}

impl Bus for WrongBitVga {
    fn out8(&mut self, port: u16, value: u8) {
        let data = self.data && port == ATTRIBUTE;
        self.data ^= port == ATTRIBUTE;
        let value = match port {
            MISC_WRITE => self.write("misc", 0, value),
            PEL_MASK => self.write("pel-mask", 0, value),
            ATTRIBUTE if data => self.write("attribute", self.selected[3], value),
            _ => {
                if let Some(at) = PORTS.iter().position(|(_, of)| *of == port) {
                    self.selected[at] = value;
                }
                value
            }
        };
        self.vga.out8(port, value);
    }

    fn out16(&mut self, port: u16, value: u16) {
        let [index, data] = value.to_le_bytes();
        let data = match PORTS.iter().find(|(_, of)| *of == port) {
            Some((block, _)) => self.write(block, index, data),
            None => data,
        };
        self.vga.out16(port, u16::from_le_bytes([index, data]));
    }

    fn in8(&mut self, port: u16) -> u8 {
        let value = self.vga.in8(port);
        match port {
            INPUT_STATUS_1 => {
                self.data = false;
                value
            }
            MISC_READ => self.read("misc", 0, value),
            PEL_MASK => self.read("pel-mask", 0, value),
            _ => match PORTS.iter().position(|(_, of)| of + 1 == port) {
                Some(at) => self.read(PORTS[at].0, self.selected[at], value),
                None => value,
            },
        }
    }

    fn in16(&mut self, port: u16) -> u16 {
        self.vga.in16(port)
    }

    fn store64(&mut self, at: u16, bytes: u64) {
        self.vga.store64(at, bytes);
    }

    fn load8(&mut self, at: u16) -> u8 {
        self.vga.load8(at)
    }

    fn lane<const STEP: usize>(&mut self, at: u16, len: u16, draw: impl FnOnce(Lane<'_, STEP>)) {
        self.vga.lane(at, len, draw);
    }
}

/// Bits that may be wrong in the table: block, index, bits, and why a wrong bit has no effect.
const FREE: [(&str, u8, u8, &str); 2] = [
    (
        "crtc",
        0x11,
        PROTECT,
        "the driver clears the bit before it writes CR0 to CR7, and the bit has no effect after that",
    ),
    (
        "graphics",
        READ_MAP,
        0x03,
        "each load writes Read Map first",
    ),
];

/// Returns the fault that a mode set with one wrong bit in the table causes, or the page that the monitor
/// shows instead of page 0.
fn fault_of(block: &'static str, index: u8, right: u8, bit: u8) -> Option<String> {
    let mut card = WrongBitVga {
        vga: Vga::new(),
        block,
        index,
        right,
        bit,
        wrong: false,
        written: false,
        selected: [0; 4],
        data: false,
    };
    let set = ModeX::set(&mut card, &[[0; 3]; 256]).map(drop);
    let WrongBitVga {
        mut vga, written, ..
    } = card;
    assert!(written, "the driver never wrote this value");
    let faults = vga.take_faults();
    if let Some(fault) = faults.first() {
        assert_ne!(fault.access, Access::ScanOut);
        return Some(fault.to_string());
    }
    match (set, vga.page()) {
        (Err(error), _) => Some(error.to_string()),
        (_, Err(fault)) => Some(fault.to_string()),
        (_, Ok(page)) if page.start != 0 => {
            Some(format!("the page at {:04x} is shown", page.start))
        }
        _ => None,
    }
}

#[test]
fn every_wrong_bit_of_the_register_table_is_a_fault() {
    let mut unexpected = Vec::new();
    for (block, registers) in MODE_X.blocks() {
        for (index, &right) in (0..).zip(registers) {
            for bit in (0..8).map(|bit| 1 << bit) {
                let free = FREE
                    .iter()
                    .any(|&(b, i, bits, _)| (b, i) == (block, index) && bits & bit != 0);
                let fault = fault_of(block, index, right, bit);
                if fault.is_none() != free {
                    unexpected.push(format!("{block} {index:02X} bit {bit:02X}: {fault:?}"));
                }
            }
        }
    }
    assert!(unexpected.is_empty(), "{unexpected:#?}");
    // Without a wrong bit there is no fault.
    assert_eq!(fault_of("misc", 0, MODE_X.misc, 0), None);
}

/// The fault names the registers, the required time and the given time.
#[test]
fn a_wrong_time_is_reported_with_the_required_time() {
    for (index, bit, expected) in [
        (
            0x00,
            0x01,
            "CR00 horizontal total: 100 character clocks needed, the write gives 99",
        ),
        (
            0x03,
            0x01,
            "CR02, CR03, CR05 end of horizontal blank: 98 character clocks needed",
        ),
        (
            0x06,
            0x02,
            "CR06, CR07 vertical total: 527 lines needed, the write gives 529",
        ),
        (
            0x07,
            0x40,
            "CR07, CR12 vertical display end: 480 lines needed, the write gives 992",
        ),
        (
            0x09,
            0x80,
            "CR09 scan lines of each line: 2 lines needed, the write gives 4",
        ),
        (
            0x16,
            0x80,
            "CR07, CR09, CR15, CR16 end of vertical blank: 518 lines needed",
        ),
        (
            0x18,
            0x01,
            "CR07, CR09, CR18 line compare: 1023 lines needed, the write gives 1022",
        ),
        (
            0x14,
            0x40,
            "CR13, CR14, CR17 offset from line to line: 80 bytes needed",
        ),
        (
            0x17,
            0x80,
            "CR17 = 63h: bits 80h must be 80h: the syncs are on",
        ),
    ] {
        let right = MODE_X.crtc[usize::from(index)];
        let fault = fault_of("crtc", index, right, bit).unwrap_or_default();
        assert!(fault.contains(expected), "{expected}: {fault}");
    }
}
