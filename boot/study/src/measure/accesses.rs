//! What drawing does to the card, counted on the emulated one.
//!
//! The measuring kernel counts nothing while it takes time. The same work done here, on a card that
//! is looked into from outside, says how often the card is reached; and that the kernel drew the same
//! pictures says that it was the same work.

use anyhow::{bail, ensure};
use cost::{Ask, Bench, Clock, Memory, Work};
use in_place::InPlace;
use modex::{Bus, Counted, Tally};
use texmap::{Mapper, Order};
use vga::Vga;

/// What a picture of the ball does to the card.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Accesses {
    /// Port writes and stores that draw, or present what was drawn in RAM.
    pub draw: Tally,
    /// Those that restore the background.
    pub erase: Tally,
    /// Those that flip.
    pub flip: Tally,
    /// Loads from video memory, for whatever purpose.
    pub loads: u64,
}

/// What the benches on the emulated card borrow.
#[derive(Debug)]
pub struct Memories {
    counted: InPlace<Memory>,
    plain: InPlace<Memory>,
}

impl Default for Memories {
    fn default() -> Self {
        let counted = in_place::boxed!(Memory);
        let plain = counted.clone();
        Self { counted, plain }
    }
}

/// The measuring kernel's works on the emulated card, with counters and without.
#[derive(Debug)]
pub struct Emulated<'a> {
    counted: Bench<'a, Counted<Vga>>,
    plain: Bench<'a, Vga>,
}

/// Nobody takes the time here.
const NO_CLOCK: Clock = Clock {
    now: || 0,
    instructions: |_| (),
    bmi2: false,
};

impl<'a> Emulated<'a> {
    /// Cards as after the mode set.
    pub fn new(memories: &'a mut Memories) -> Self {
        let taken = "the emulated card takes Mode X";
        let counted = Counted::new(Vga::new());
        Self {
            counted: Bench::new(&mut memories.counted, counted).expect(taken),
            plain: Bench::new(&mut memories.plain, Vga::new()).expect(taken),
        }
    }

    /// What a picture of the ball, frame [`cost::FRAME`], does to the card: drawn by a mapper in an
    /// order, on a page that holds the same picture before.
    ///
    /// # Errors
    /// Accesses at fault, and counts that differ from picture to picture.
    pub fn accesses(&mut self, mapper: Mapper, order: Order) -> anyhow::Result<Accesses> {
        let work = super::whole_frame(order);
        let bench = &mut self.counted;
        bench.set(mapper, order);
        // It has the ball on every page.
        bench.prepare(Work::Present);
        let mut one = || {
            bench.bus().take_counts();
            bench.run(work, NO_CLOCK.now);
            bench.bus().take_counts()
        };
        let (counts, again) = (one(), one());
        let faults = bench.bus().inner().take_faults();
        if let Some(fault) = faults.first() {
            bail!("the emulated card finds an access at fault: {fault}");
        }
        ensure!(
            counts == again,
            "the accesses of {mapper} in the order {order} do not repeat: {counts:?}, {again:?}"
        );
        let pictures = u64::from(work.pictures());
        let each = |tally: Tally| Tally {
            ports: tally.ports / pictures,
            map_mask: tally.map_mask / pictures,
            stores: tally.stores / pictures,
            bytes: tally.bytes / pictures,
            loads: tally.loads / pictures,
        };
        let loads: u64 = counts.named().iter().map(|(_, tally)| tally.loads).sum();
        Ok(Accesses {
            draw: each(counts.draw),
            erase: each(counts.erase),
            flip: each(counts.flip),
            loads: loads / pictures,
        })
    }

    /// The checksums of what each work draws, in the measuring kernel's words: on a card without a
    /// counter and on one behind counters.
    ///
    /// # Errors
    /// Accesses at fault.
    pub fn checksums(&mut self, mapper: Mapper, order: Order) -> anyhow::Result<[Vec<String>; 2]> {
        let plain = check(&mut self.plain, mapper, order);
        let counted = check(&mut self.counted, mapper, order);
        let mut faults = self.plain.bus().take_faults();
        faults.append(&mut self.counted.bus().inner().take_faults());
        if let Some(fault) = faults.first() {
            bail!("the emulated card finds an access at fault: {fault}");
        }
        Ok([plain, counted])
    }

    /// Compares checksums that the kernel told with those of the emulated card.
    ///
    /// # Errors
    /// A picture that differs.
    pub fn compare(&mut self, mapper: Mapper, order: Order, told: &[String]) -> anyhow::Result<()> {
        for emulated in self.checksums(mapper, order)? {
            ensure!(
                told == emulated,
                "{mapper} in the order {order} draws {told:?} in QEMU and {emulated:?} on the \
                 emulated card"
            );
        }
        Ok(())
    }
}

/// The lines of the answer to `check`, without the one that closes it.
fn check<B: Bus>(bench: &mut Bench<'_, B>, mapper: Mapper, order: Order) -> Vec<String> {
    let mut answer = Vec::new();
    bench.answer(Ask::Check(mapper, order), &NO_CLOCK, &mut |line| {
        answer.push(line.to_string());
    });
    answer.pop();
    answer
}
