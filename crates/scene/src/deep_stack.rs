//! Reading texts of strangers whose values lie deep in each other.

use std::io;
use std::panic::resume_unwind;
use std::thread;

/// 10 kB for each of the 6,600 values in each other that the reader of TOML lets pass (80 brackets
/// and headers with keys of 80 parts), several times what it needs. Only what is touched becomes
/// memory.
const STACK_BYTES: usize = 64 << 20;

/// Reads on a thread of its own with a stack of 64 MiB, and waits for it. It is for readers that
/// recurse for values in values, such as those of TOML, whose own limit is beyond the stack of many
/// threads: a stack that overflows ends the program. What lies deep must not leave `read`, because
/// to drop it recurses, too.
///
/// ```
/// let sum = nemoral_scene::on_deep_stack(|| 1 + 2)?;
/// assert_eq!(sum, 3);
/// # Ok::<(), std::io::Error>(())
/// ```
///
/// # Errors
/// If the thread cannot be started.
///
/// # Panics
/// If `read` does.
pub fn on_deep_stack<T: Send>(read: impl FnOnce() -> T + Send) -> io::Result<T> {
    thread::scope(|scope| {
        let builder = thread::Builder::new().stack_size(STACK_BYTES);
        let reader = builder.spawn_scoped(scope, read).map_err(|e| {
            let message = format!("cannot start a thread to read: {e}");
            io::Error::new(e.kind(), message)
        })?;
        Ok(reader.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    /// Recurses with some 4 kB of stack for each level.
    fn levels(left: u32) -> u32 {
        let filling = [left; 1024];
        black_box(&filling);
        if left == 0 {
            return 0;
        }
        let below = levels(left - 1);
        below + u32::from(black_box(&filling)[1023] == left)
    }

    #[test]
    fn as_many_levels_fit_as_toml_has() {
        // 27 MB, thirteen times the stack of a test.
        assert_eq!(on_deep_stack(|| levels(6_600)).expect("a thread"), 6_600);
    }

    #[test]
    fn a_panic_is_passed_on() {
        let panic = std::panic::catch_unwind(|| on_deep_stack(|| panic!("told")));
        let panic = panic.map(|read: io::Result<()>| read.is_ok());
        let panic = panic.expect_err("a panic");
        assert_eq!(panic.downcast_ref::<&str>(), Some(&"told"));
    }
}
