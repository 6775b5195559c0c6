//! A ring buffer between an interrupt handler and the program.

use core::sync::atomic::{AtomicU16, AtomicU32, Ordering};

/// A queue of up to `SIZE` items for a single producer and a single consumer. `SIZE` is a power of two, so
/// that the two counters may wrap.
///
/// The producer is an interrupt handler and the consumer is the program that it interrupts, or they are two
/// threads: neither waits for the other. The ring keeps its order only if one caller at a time calls
/// [`Ring::push`], and one at a time calls [`Ring::pop`].
#[derive(Debug)]
pub struct Ring<const SIZE: usize> {
    items: [AtomicU16; SIZE],
    /// Items stored so far. Only the producer writes it.
    stored: AtomicU32,
    /// Items fetched so far. Only the consumer writes it.
    fetched: AtomicU32,
}

impl<const SIZE: usize> Ring<SIZE> {
    /// Returns an empty ring.
    pub const fn new() -> Self {
        const { assert!(SIZE.is_power_of_two() && SIZE <= 1 << 16) }
        Self {
            items: [const { AtomicU16::new(0) }; SIZE],
            stored: AtomicU32::new(0),
            fetched: AtomicU32::new(0),
        }
    }

    /// Stores an item. Returns false, and drops the item, if the ring is full.
    #[must_use]
    pub fn push(&self, item: u16) -> bool {
        if self.len() == SIZE {
            return false;
        }
        let stored = self.stored.load(Ordering::Relaxed);
        self.items[stored as usize % SIZE].store(item, Ordering::Relaxed);
        // Release: the consumer sees the item before it sees the count.
        self.stored.store(stored.wrapping_add(1), Ordering::Release);
        true
    }

    /// Removes the oldest item and returns it, or `None` if the ring is empty.
    pub fn pop(&self) -> Option<u16> {
        if self.is_empty() {
            return None;
        }
        let fetched = self.fetched.load(Ordering::Relaxed);
        let item = self.items[fetched as usize % SIZE].load(Ordering::Relaxed);
        // Release: the producer reuses the place only after the item was read.
        self.fetched
            .store(fetched.wrapping_add(1), Ordering::Release);
        Some(item)
    }

    /// Returns the number of items in the ring, 0 to `SIZE`.
    pub fn len(&self) -> usize {
        let fetched = self.fetched.load(Ordering::Acquire);
        self.stored.load(Ordering::Acquire).wrapping_sub(fetched) as usize
    }

    /// Returns whether the ring has no items.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether the ring has no room.
    pub fn is_full(&self) -> bool {
        self.len() == SIZE
    }
}

impl<const SIZE: usize> Default for Ring<SIZE> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use std::sync::Arc;

    #[test]
    fn any_order_of_calls_gives_the_items_of_a_queue() {
        let mut random = seeded::generator();
        let ring = Ring::<8>::new();
        // The counters wrap during the test.
        ring.stored.store(u32::MAX - 500, Ordering::Relaxed);
        ring.fetched.store(u32::MAX - 500, Ordering::Relaxed);
        let mut queue = VecDeque::new();
        for item in 0..10_000 {
            if random.bool() {
                let room = queue.len() < 8;
                assert_eq!(ring.push(item), room);
                if room {
                    queue.push_back(item);
                }
            } else {
                assert_eq!(ring.pop(), queue.pop_front());
            }
            assert_eq!(ring.len(), queue.len());
            assert_eq!(ring.is_empty(), queue.is_empty());
            assert_eq!(ring.is_full(), queue.len() == 8);
        }
    }

    #[test]
    fn two_threads_lose_nothing_and_keep_the_order() {
        const ITEMS: u16 = 50_000;
        let ring = Arc::new(Ring::<16>::new());
        let producer = std::thread::spawn({
            let ring = ring.clone();
            move || {
                for item in 0..ITEMS {
                    while !ring.push(item) {
                        std::thread::yield_now();
                    }
                }
            }
        });
        for expected in 0..ITEMS {
            let item = loop {
                match ring.pop() {
                    Some(item) => break item,
                    None => std::thread::yield_now(),
                }
            };
            assert_eq!(item, expected);
        }
        producer.join().unwrap();
        assert_eq!(ring.pop(), None);
    }
}
