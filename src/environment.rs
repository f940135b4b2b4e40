//! The process's own environment, set before anything reads it.

/// Mesa's device-selection layer looks for a Wayland display and complains on standard error when there is no session
/// to find one in. Without a session there is nothing to select either.
#[allow(unsafe_code)]
pub fn quiet_device_selection() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first thing in `main`, before any other thread exists.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
