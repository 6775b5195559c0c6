//! The stack frame of an exception or interrupt.

/// The values that the CPU and a stub have pushed on the stack, from the lowest address up.
#[derive(Debug)]
#[repr(C)]
pub struct Frame {
    /// The address that a page fault was caused by.
    pub cr2: u64,
    general: [u64; 15],
    /// The vector of the exception or interrupt.
    pub vector: u64,
    /// The CPU's error code, or 0 for an exception without one.
    pub error: u64,
    /// Instruction pointer at the exception or interrupt.
    pub rip: u64,
    /// Code segment at `rip`.
    pub cs: u64,
    /// Flags at the exception or interrupt.
    pub rflags: u64,
    /// Stack pointer at the exception or interrupt.
    pub rsp: u64,
    /// Stack segment at the exception or interrupt.
    pub ss: u64,
}

impl Frame {
    /// Returns the general registers with their names, in the order of a report.
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
