//! Descriptor tables, exceptions and interrupts.
//!
//! Handlers are naked stubs that save every general register before Rust code runs, so that an exception is
//! reported with the registers as they were. (The `x86-interrupt` ABI needs a nightly compiler and never
//! shows the registers.) Page faults and double faults each run on a separate stack: the usual cause of
//! either is that the kernel's stack is used up.

use core::arch::naked_asm;
use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU64, Ordering};

use pic8259::ChainedPics;
use spin::{LazyLock, Mutex};
use x86_64::VirtAddr;
use x86_64::instructions::segmentation::{CS, DS, ES, SS, Segment};
use x86_64::instructions::tables::{lidt, load_tss};
use x86_64::structures::DescriptorTablePointer;
use x86_64::structures::gdt::{Descriptor, GlobalDescriptorTable, SegmentSelector};
use x86_64::structures::idt::InterruptDescriptorTable;
use x86_64::structures::tss::TaskStateSegment;

use super::frame::Frame;
use super::{keyboard, report, serial, timer};

/// Vector of IRQ 0. The vectors below it are the CPU's exceptions.
const IRQ_BASE: u8 = 32;
const IRQ_TIMER: u8 = IRQ_BASE;
const IRQ_KEYBOARD: u8 = IRQ_BASE + 1;
const IRQ_SERIAL: u8 = IRQ_BASE + 4;
/// IRQ 7 also arrives spuriously, when a request ends before the CPU acknowledges it.
const IRQ_SPURIOUS: u8 = IRQ_BASE + 7;
/// Interrupt lines that stay masked: all but the timer's, the keyboard's and COM1's.
const MASK: [u8; 2] = [!0b0001_0011, 0xFF];

const PAGE_FAULT: u64 = 14;
const PAGE_FAULT_STACK: u16 = 0;
const DOUBLE_FAULT_STACK: u16 = 1;
const STACK_BYTES: usize = 16 * 1024;
const PAGE_BYTES: u64 = 4096;

/// A stack that the CPU switches to. Only the CPU writes it; Rust code only uses its address.
#[repr(align(16))]
struct Stack(UnsafeCell<[u8; STACK_BYTES]>);

// SAFETY: no code reads or writes the bytes through a reference.
unsafe impl Sync for Stack {}

static STACKS: [Stack; 2] = [const { Stack(UnsafeCell::new([0; STACK_BYTES])) }; 2];

// SAFETY: the PICs are moved to vectors that have handlers in this file.
static PICS: Mutex<ChainedPics> = Mutex::new(unsafe { ChainedPics::new(IRQ_BASE, IRQ_BASE + 8) });

/// Lowest address of the kernel's stack. The page below it is not mapped.
static STACK_BOTTOM: AtomicU64 = AtomicU64::new(0);

static TSS: LazyLock<TaskStateSegment> = LazyLock::new(|| {
    let mut tss = TaskStateSegment::new();
    for (slot, stack) in [PAGE_FAULT_STACK, DOUBLE_FAULT_STACK]
        .into_iter()
        .zip(&STACKS)
    {
        // Stacks grow down from their end.
        let end = VirtAddr::from_ptr(stack.0.get()) + STACK_BYTES as u64;
        tss.interrupt_stack_table[usize::from(slot)] = end;
    }
    tss
});

struct Segments {
    table: GlobalDescriptorTable,
    code: SegmentSelector,
    data: SegmentSelector,
    tss: SegmentSelector,
}

static GDT: LazyLock<Segments> = LazyLock::new(|| {
    let mut table = GlobalDescriptorTable::new();
    let code = table.append(Descriptor::kernel_code_segment());
    let data = table.append(Descriptor::kernel_data_segment());
    let tss = table.append(Descriptor::tss_segment(&TSS));
    Segments {
        table,
        code,
        data,
        tss,
    }
});

static IDT: LazyLock<InterruptDescriptorTable> = LazyLock::new(interrupt_table);

/// Loads the tables and unmasks the interrupts of timer, keyboard and COM1.
pub fn init(stack_bottom: u64) {
    STACK_BOTTOM.store(stack_bottom, Ordering::Relaxed);
    GDT.table.load();
    // SAFETY: the selector is from the table just loaded.
    unsafe { CS::set_reg(GDT.code) };
    for set in [SS::set_reg, DS::set_reg, ES::set_reg] {
        // SAFETY: as above. If SS kept its old selector, the next IRET would look that selector up in the new
        // table.
        unsafe { set(GDT.data) };
    }
    // SAFETY: as above, and the segment is a static.
    unsafe { load_tss(GDT.tss) };
    IDT.load();
    let mut pics = PICS.lock();
    // SAFETY: all vectors that the PICs use have handlers in the table just loaded.
    unsafe { pics.initialize() };
    // SAFETY: a mask only holds interrupts back.
    unsafe { pics.write_masks(MASK[0], MASK[1]) };
}

/// The stub of vector `VECTOR`. If `CODE` is 0, the vector has no error code, and the stub pushes a zero in
/// its place.
///
/// Every stub jumps to [`save_and_dispatch`], which restores the registers because interrupts return.
#[unsafe(naked)]
extern "C" fn stub<const VECTOR: u8, const CODE: u8>() {
    naked_asm!(
        ".if {code} == 0",
        "push 0",
        ".endif",
        "push {vector}",
        "jmp {save}",
        code = const CODE,
        vector = const VECTOR,
        save = sym save_and_dispatch,
    )
}

#[unsafe(naked)]
extern "C" fn save_and_dispatch() {
    naked_asm!(
        "push rax",
        "push rbx",
        "push rcx",
        "push rdx",
        "push rsi",
        "push rdi",
        "push rbp",
        "push r8",
        "push r9",
        "push r10",
        "push r11",
        "push r12",
        "push r13",
        "push r14",
        "push r15",
        "mov rax, cr2",
        "push rax",
        "mov rdi, rsp",
        "cld",
        // The CPU aligned the stack to 16 bytes before it pushed; 23 words are on it now.
        "sub rsp, 8",
        "call {dispatch}",
        "add rsp, 16",
        "pop r15",
        "pop r14",
        "pop r13",
        "pop r12",
        "pop r11",
        "pop r10",
        "pop r9",
        "pop r8",
        "pop rbp",
        "pop rdi",
        "pop rsi",
        "pop rdx",
        "pop rcx",
        "pop rbx",
        "pop rax",
        "add rsp, 16",
        "iretq",
        dispatch = sym dispatch,
    )
}

extern "C" fn dispatch(frame: &Frame) {
    match frame.vector as u8 {
        IRQ_TIMER => {
            timer::tick();
            end_of_interrupt(IRQ_TIMER);
        }
        IRQ_KEYBOARD => {
            keyboard::handle_interrupt();
            end_of_interrupt(IRQ_KEYBOARD);
        }
        IRQ_SERIAL => {
            serial::handle_interrupt();
            end_of_interrupt(IRQ_SERIAL);
        }
        IRQ_SPURIOUS => {}
        _ => report::exception(name(frame), frame),
    }
}

fn end_of_interrupt(vector: u8) {
    // SAFETY: called once, by the handler of that vector.
    unsafe { PICS.lock().notify_end_of_interrupt(vector) };
}

fn name(frame: &Frame) -> &'static str {
    let bottom = STACK_BOTTOM.load(Ordering::Relaxed);
    if frame.vector == PAGE_FAULT && (bottom - PAGE_BYTES..bottom).contains(&frame.cr2) {
        return "stack overflow: page fault in the guard page below the kernel's stack";
    }
    match frame.vector {
        0 => "divide error",
        1 => "debug",
        2 => "non-maskable interrupt",
        3 => "breakpoint",
        4 => "overflow",
        5 => "bound range exceeded",
        6 => "invalid opcode",
        7 => "device not available",
        8 => "double fault",
        10 => "invalid TSS",
        11 => "segment not present",
        12 => "stack-segment fault",
        13 => "general protection",
        14 => "page fault",
        16 => "x87 floating-point error",
        17 => "alignment check",
        18 => "machine check",
        19 => "SIMD floating-point error",
        20 => "virtualization",
        21 => "control protection",
        _ => "reserved",
    }
}

fn interrupt_table() -> InterruptDescriptorTable {
    let mut idt = InterruptDescriptorTable::new();
    /// Address of a stub, in the type of the table.
    macro_rules! stub {
        ($vector:expr, $code:expr) => {
            VirtAddr::from_ptr(stub::<{ $vector }, { $code }> as *const ())
        };
    }
    /// Sets the handlers that need no separate stack.
    macro_rules! set {
        ($($entry:expr => $vector:expr, $code:expr;)*) => {$(
            // SAFETY: the stub saves and restores every register and matches its error code.
            unsafe { $entry.set_handler_addr(stub!($vector, $code)) };
        )*};
    }
    set! {
        idt.divide_error => 0, 0;
        idt.debug => 1, 0;
        idt.non_maskable_interrupt => 2, 0;
        idt.breakpoint => 3, 0;
        idt.overflow => 4, 0;
        idt.bound_range_exceeded => 5, 0;
        idt.invalid_opcode => 6, 0;
        idt.device_not_available => 7, 0;
        idt.invalid_tss => 10, 1;
        idt.segment_not_present => 11, 1;
        idt.stack_segment_fault => 12, 1;
        idt.general_protection_fault => 13, 1;
        idt.x87_floating_point => 16, 0;
        idt.alignment_check => 17, 1;
        idt.machine_check => 18, 0;
        idt.simd_floating_point => 19, 0;
        idt.virtualization => 20, 0;
        idt.cp_protection_exception => 21, 1;
        idt[IRQ_TIMER] => IRQ_TIMER, 0;
        idt[IRQ_KEYBOARD] => IRQ_KEYBOARD, 0;
        idt[IRQ_SERIAL] => IRQ_SERIAL, 0;
        idt[IRQ_SPURIOUS] => IRQ_SPURIOUS, 0;
    }
    // SAFETY: as for the handlers above.
    let double_fault = unsafe { idt.double_fault.set_handler_addr(stub!(8, 1)) };
    // SAFETY: only the double fault uses this stack.
    unsafe { double_fault.set_stack_index(DOUBLE_FAULT_STACK) };
    // SAFETY: as for the handlers above.
    let page_fault = unsafe { idt.page_fault.set_handler_addr(stub!(14, 1)) };
    // SAFETY: only the page fault uses this stack.
    unsafe { page_fault.set_stack_index(PAGE_FAULT_STACK) };
    idt
}

/// Causes a page fault by a read from an address that is not mapped.
pub fn page_fault() -> ! {
    // The boot loader maps nothing into the first page, so that null pointers fault. The address is not 0,
    // because the compiler may assume that no access to 0 happens.
    let nowhere = core::ptr::without_provenance::<u8>(0x40);
    // SAFETY: none. The read faults, which is its purpose.
    let read = unsafe { nowhere.read_volatile() };
    panic!("address {nowhere:p} was readable ({read:02x})")
}

/// Overflows the stack by endless recursion.
pub fn stack_overflow() -> ! {
    #[inline(never)]
    fn deeper(depth: u64) -> u64 {
        let page = core::hint::black_box([depth; 64]);
        // Work remains after the call, so the compiler cannot turn the recursion into a loop.
        if depth == u64::MAX {
            0
        } else {
            deeper(depth + 1) + page[7]
        }
    }
    panic!("the stack held {} calls", deeper(0))
}

/// Raises an exception without a table of handlers, so that the CPU resets.
pub fn triple_fault() -> ! {
    let empty = DescriptorTablePointer {
        limit: 0,
        base: VirtAddr::new(0),
    };
    // SAFETY: none. The next exception finds no handler, which is its purpose.
    unsafe { lidt(&empty) };
    x86_64::instructions::interrupts::int3();
    super::stop()
}
