//! The stack frame of an exception or interrupt.

/// Everything the CPU and a stub put on the stack, from the lowest address up.
#[derive(Debug)]
#[repr(C)]
pub struct Frame {
    /// The address that a page fault is about.
    pub cr2: u64,
    general: [u64; 15],
    /// Which exception or interrupt.
    pub vector: u64,
    /// The CPU's error code, or 0 for an exception without one.
    pub error: u64,
    /// Where it happened.
    pub rip: u64,
    /// The code segment there.
    pub cs: u64,
    /// The flags there.
    pub rflags: u64,
    /// The stack there.
    pub rsp: u64,
    /// The stack segment there.
    pub ss: u64,
}

impl Frame {
    /// The general registers by name, in the order in which they are told.
    pub fn general(&self) -> [(&'static str, u64); 15] {
        let [
            r15,
            r14,
            r13,
            r12,
            r11,
            r10,
            r9,
            r8,
            rbp,
            rdi,
            rsi,
            rdx,
            rcx,
            rbx,
            rax,
        ] = self.general;
        [
            ("rax", rax),
            ("rbx", rbx),
            ("rcx", rcx),
            ("rdx", rdx),
            ("rsi", rsi),
            ("rdi", rdi),
            ("rbp", rbp),
            ("r8", r8),
            ("r9", r9),
            ("r10", r10),
            ("r11", r11),
            ("r12", r12),
            ("r13", r13),
            ("r14", r14),
            ("r15", r15),
        ]
    }
}
