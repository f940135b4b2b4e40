//! The process's own environment, set before anything reads it.

/// Keeps libraries from writing to standard error what the user can do nothing about. What the user has set stays.
#[allow(unsafe_code)]
pub fn quiet_libraries() {
    let mut settings = Vec::new();
    // Mesa's device-selection layer looks for a Wayland display and complains when there is no session to find one
    // in. Without a session there is nothing to select either.
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        settings.push(("NODEVICE_SELECT", "1"));
    }
    // FFmpeg's libraries inside OpenCV report a damaged clip in their own words before this program does; -8 is
    // their level for silence.
    if std::env::var_os("OPENCV_FFMPEG_LOGLEVEL").is_none() {
        settings.push(("OPENCV_FFMPEG_LOGLEVEL", "-8"));
    }
    for (name, value) in settings {
        // SAFETY: called first thing in `main`, before any other thread exists.
        unsafe { std::env::set_var(name, value) };
    }
}
