//! The accesses of drawing to video memory and ports, counted on the emulated VGA.
//!
//! The benchmark kernel counts nothing while it measures times. So the same work runs here on an emulated VGA
//! that counts the accesses. Equal checksums of the frames prove that both VGAs did the same work.

use anyhow::{bail, ensure};
use bench::{Bench, BenchMemory, BenchRequest, Clock, Work};
use in_place::InPlace;
use modex::{Bus, Counted, Tally};
use texmap::{Mapper, Order};
use vga::Vga;

/// The accesses of one frame of the ball.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Accesses {
    /// The port writes and stores that draw, or that present what was drawn in RAM.
    pub draw: Tally,
    /// The accesses that restore the background.
    pub erase: Tally,
    /// The accesses that flip.
    pub flip: Tally,
    /// The loads from video memory, for any purpose.
    pub loads: u64,
}

/// The memory that the benches on the emulated VGAs borrow.
#[derive(Debug)]
pub struct BenchMemories {
    counted: InPlace<BenchMemory>,
    plain: InPlace<BenchMemory>,
}

impl Default for BenchMemories {
    fn default() -> Self {
        let counted = in_place::boxed!(BenchMemory);
        let plain = counted.clone();
        Self { counted, plain }
    }
}

/// Two benches with the benchmark kernel's work on emulated VGAs: with counters and without.
#[derive(Debug)]
pub struct EmulatedBenches<'a> {
    counted: Bench<'a, Counted<Vga>>,
    plain: Bench<'a, Vga>,
}

/// A clock that stands still, because nothing is timed here.
const NO_CLOCK: Clock = Clock {
    now: || 0,
    instructions: |_| (),
    bmi2: false,
};

impl<'a> EmulatedBenches<'a> {
    /// Returns benches whose emulated VGAs are in the state after the mode set.
    pub fn new(memories: &'a mut BenchMemories) -> Self {
        let accepted = "the emulated VGA accepts the mode set";
        let counted = Counted::new(Vga::new());
        Self {
            counted: Bench::new(&mut memories.counted, counted).expect(accepted),
            plain: Bench::new(&mut memories.plain, Vga::new()).expect(accepted),
        }
    }

    /// Returns the accesses of one frame of the ball, frame [`bench::FRAME`], that a mapper draws in an order
    /// on a page that holds the same frame already.
    ///
    /// # Errors
    /// Accesses that are faults, and counts that differ from frame to frame.
    pub fn accesses(&mut self, mapper: Mapper, order: Order) -> anyhow::Result<Accesses> {
        let work = whole_frame(order);
        let bench = &mut self.counted;
        bench.set(mapper, order);
        // This work puts the ball on every page.
        bench.prepare(Work::Present);
        let mut one = || {
            bench.bus().take_counts();
            bench.run(work, NO_CLOCK.now);
            bench.bus().take_counts()
        };
        let (counts, again) = (one(), one());
        let faults = bench.bus().inner().take_faults();
        if let Some(fault) = faults.first() {
            bail!("{mapper} in the order {order}: the emulated VGA found a fault: {fault}");
        }
        ensure!(
            counts == again,
            "{mapper} in the order {order}: two frames have different accesses: {counts:?}, {again:?}"
        );
        let frames = u64::from(work.frames());
        let each = |tally: Tally| Tally {
            ports: tally.ports / frames,
            map_mask: tally.map_mask / frames,
            stores: tally.stores / frames,
            bytes: tally.bytes / frames,
            loads: tally.loads / frames,
        };
        let loads: u64 = counts.named().iter().map(|(_, tally)| tally.loads).sum();
        Ok(Accesses {
            draw: each(counts.draw),
            erase: each(counts.erase),
            flip: each(counts.flip),
            loads: loads / frames,
        })
    }

    /// Returns the checksums of each work's frame, in the form of the benchmark kernel's answer: without
    /// counters, and with counters.
    ///
    /// # Errors
    /// Accesses that are faults.
    pub fn checksums(&mut self, mapper: Mapper, order: Order) -> anyhow::Result<[Vec<String>; 2]> {
        let plain = check(&mut self.plain, mapper, order);
        let counted = check(&mut self.counted, mapper, order);
        let mut faults = self.plain.bus().take_faults();
        faults.append(&mut self.counted.bus().inner().take_faults());
        if let Some(fault) = faults.first() {
            bail!("{mapper} in the order {order}: the emulated VGA found a fault: {fault}");
        }
        Ok([plain, counted])
    }

    /// Compares the kernel's checksums with the emulated VGA's.
    ///
    /// # Errors
    /// A frame that differs.
    pub fn compare(
        &mut self,
        mapper: Mapper,
        order: Order,
        kernel: &[String],
    ) -> anyhow::Result<()> {
        for emulated in self.checksums(mapper, order)? {
            ensure!(
                kernel == emulated,
                "{mapper} in the order {order}: QEMU's VGA has the checksums {kernel:?}, the emulated \
                 VGA has {emulated:?}"
            );
        }
        Ok(())
    }
}

/// Returns the lines of the answer to `check`, without its last line.
fn check<B: Bus>(bench: &mut Bench<'_, B>, mapper: Mapper, order: Order) -> Vec<String> {
    let mut answer = Vec::new();
    bench.answer(BenchRequest::Check(mapper, order), &NO_CLOCK, &mut |line| {
        answer.push(line.to_string());
    });
    answer.pop();
    answer
}

/// Returns the work that is a whole frame of the ball in an order.
pub fn whole_frame(order: Order) -> Work {
    match order {
        Order::Polygons | Order::Planes => Work::FrameCard,
        Order::Buffer => Work::FramePresented,
    }
}
