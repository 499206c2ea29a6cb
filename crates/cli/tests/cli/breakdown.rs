//! Runs that break off: Ctrl-C, kill, a full disk, an unwritable one. The files that they leave are
//! whole, and the run can be resumed.
#![cfg(unix)]

use std::ffi::OsStr;
use std::fs;
use std::io::{self, PipeReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use crate::common::{
    Outcome, assert_only_whole_files, assert_same_files, base, files, folder, outcome, record,
    small,
};

/// Frames that are on disk with their record.
fn recorded(out: &Path) -> usize {
    fs::read_dir(out.join(".nemoral/frames")).map_or(0, |entries| {
        let names = entries.filter_map(|e| Some(e.ok()?.file_name()));
        names
            .filter(|n| n.to_string_lossy().ends_with(".json"))
            .count()
    })
}

/// A run that is blocked, because its standard error is full and nobody reads it.
struct Held {
    child: Child,
    stderr: PipeReader,
    filler: JoinHandle<io::Result<()>>,
}

impl Held {
    /// Starts a run and waits for its first frame, where it blocks while it reports that frame.
    fn after_a_frame(mut command: Command, out: &Path) -> Self {
        let (stderr, writer) = io::pipe().expect("a pipe");
        let mut more = writer.try_clone().expect("a pipe");
        // More than the pipes of any system hold.
        let filler = std::thread::spawn(move || more.write_all(&[0; 1 << 20]));
        let mut child = command.stderr(writer).spawn().expect("the program starts");
        wait_for_a_frame(&mut child, out, 0);
        Self {
            child,
            stderr,
            filler,
        }
    }

    /// Reads its output until it ends.
    fn released(mut self) -> Outcome {
        let mut stderr = String::new();
        self.stderr.read_to_string(&mut stderr).expect("text");
        self.filler.join().expect("no panic").expect("all was read");
        Outcome {
            code: self.child.wait().expect("it ends").code(),
            stdout: String::new(),
            stderr: stderr.replace('\0', ""),
        }
    }
}

/// Waits until a run has added to the frames that are there: `false` if it has ended instead.
fn wait_for_a_frame(child: &mut Child, out: &Path, before: usize) -> bool {
    let started = Instant::now();
    while recorded(out) <= before {
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        assert!(started.elapsed() < Duration::from_secs(300), "no frame");
        sleep(Duration::from_millis(1));
    }
    true
}

fn signal(child: &Child, signal: &str) {
    let mut kill = Command::new("kill");
    let status = kill.args([signal, &child.id().to_string()]).status();
    assert!(status.expect("kill runs").success());
}

/// A run that a signal asks to stop finishes the frames that it has begun.
#[track_caller]
fn asked_to_stop(name: &str, by: &str) -> PathBuf {
    let out = folder(name).join("out");
    let held = Held::after_a_frame(small(&out, &["--threads", "2"]), &out);
    signal(&held.child, by);
    // The signal may arrive late, but the run does not get far meanwhile.
    sleep(Duration::from_millis(300));
    let ended = held.released();
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let last = ended.stderr.lines().last().expect("a message");
    assert!(last.starts_with("error: interrupted"), "{}", ended.stderr);
    assert!(last.contains("--resume"), "{}", ended.stderr);

    // The frames that were begun are finished, and no others.
    let frames = recorded(&out);
    assert!((1..10).contains(&frames), "{frames} frames");
    assert_eq!(assert_only_whole_files(&out), 8 * frames);
    let temporary = files(&out).into_keys().find(|name| name.ends_with(".tmp"));
    assert_eq!(temporary, None);
    assert!(!out.join("dataset.json").exists(), "it is not finished");
    out
}

/// The signal that a machine's manager sends before switching it off or reassigning it.
#[test]
fn sigterm_is_as_good_as_ctrl_c() {
    asked_to_stop("terminated", "-TERM");
}

#[test]
fn ctrl_c_leaves_a_data_set_that_goes_on() {
    let out = asked_to_stop("interrupted", "-INT");
    // Without `--resume` or `--overwrite` the folder is not touched.
    let before = files(&out);
    let again = outcome(&mut small(&out, &[]));
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("unfinished"), "{}", again.stderr);
    assert!(files(&out) == before, "untouched");

    let done = outcome(&mut small(&out, &["--resume"]));
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains("(was there)"), "{}", done.stderr);
    assert_same_files(&out, base());
    // A second resume finds nothing to do and changes nothing.
    record(&out, &["--resume"]);
    assert_same_files(&out, base());
}

#[test]
fn a_killed_run_goes_on() {
    let folder = folder("killed");
    // A kill that came too late proves nothing, so it is tried again.
    let killed = (0..8).map(|i| folder.join(i.to_string())).find(|out| {
        let mut command = small(out, &["--quiet"]);
        let mut child = command.spawn().expect("the program starts");
        // It is killed some frames later, whatever it is doing then.
        let _ = wait_for_a_frame(&mut child, out, 4) && {
            signal(&child, "-KILL");
            true
        };
        child.wait().expect("it ends").code().is_none()
    });
    let out = killed.expect("one of the runs is killed in time");
    assert!(assert_only_whole_files(&out) >= 8 * recorded(&out));
    assert!(recorded(&out) > 4);
    record(&out, &["--resume"]);
    assert_same_files(&out, base());
}

/// Records under a limit of 40 blocks (of 512 or 1024 bytes) for each file, then resumes without
/// it. Arguments: the folder to record in, the folder for its copies, the command. The program's
/// output is stored beside the copies.
const SHORT_FILES: &str = r#"
out=$1 left=$2 whole=$3; shift 3
(trap '' XFSZ; ulimit -f 40; exec "$@") 2>"$left.stderr"
echo $? >"$left.code"
cp -a "$out" "$left" || exit 1
"$@" --resume 2>"$whole.stderr"
echo $? >"$whole.code"
cp -a "$out" "$whole" || exit 1
"#;

/// The same on a file system of 600 kB, which is enlarged afterwards. Exit code 77 means that the
/// system allows no such file system.
const SMALL_DISK: &str = r#"
out=$1 left=$2 whole=$3 disk=$(dirname "$1"); shift 3
mount -t tmpfs -o size=600k none "$disk" || exit 77
"$@" 2>"$left.stderr"
echo $? >"$left.code"
cp -a "$out" "$left" || exit 1
mount -o remount,size=64m "$disk" || exit 1
"$@" --resume 2>"$whole.stderr"
echo $? >"$whole.code"
cp -a "$out" "$whole" || exit 1
"#;

/// A read-only file system over a folder.
const READ_ONLY: &str = r#"
mount -t tmpfs -o ro none "$1" || exit 77
shift
exec "$@"
"#;

/// Runs a script in a mount namespace of its own, so that no mount stays behind; other users than
/// root become root in a user namespace. `None` if the system does not have or allow namespaces.
fn with_mounts(script: &str, arguments: &[&OsStr]) -> Option<Outcome> {
    let is_root = outcome(Command::new("id").arg("-u")).stdout.trim() == "0";
    let namespace = if is_root { "-m" } else { "-rm" };
    let mut unshare = Command::new("unshare");
    unshare.args([namespace, "sh", "-c", script, "script"]);
    unshare.args(arguments).stdin(Stdio::null());
    let ran = unshare.output().ok()?;
    let stderr = String::from_utf8_lossy(&ran.stderr).into_owned();
    if ran.status.code() == Some(77) || stderr.starts_with("unshare:") {
        let must = is_root && std::env::var("CI").is_ok_and(|v| v == "true");
        assert!(!must, "root in CI may mount: {stderr}");
        // This is visible even where the output of tests is captured.
        let _ = writeln!(io::stderr(), "\nleft out what needs a mount: {stderr}");
        return None;
    }
    Some(Outcome {
        code: ran.status.code(),
        stdout: String::from_utf8_lossy(&ran.stdout).into_owned(),
        stderr,
    })
}

/// A folder to record in, and the folders that the scripts copy the interrupted and the finished
/// data set to.
struct Places {
    out: PathBuf,
    left: PathBuf,
    whole: PathBuf,
}

impl Places {
    fn new(name: &str) -> Self {
        let folder = folder(name);
        fs::create_dir(folder.join("disk")).expect("a folder");
        Self {
            out: folder.join("disk/out"),
            left: folder.join("left"),
            whole: folder.join("whole"),
        }
    }

    /// What the scripts take.
    fn arguments<'a>(&'a self, request: &'a Command) -> Vec<&'a OsStr> {
        let places = [&self.out, &self.left, &self.whole].map(|p| p.as_os_str());
        let program = std::iter::once(request.get_program());
        places
            .into_iter()
            .chain(program)
            .chain(request.get_args())
            .collect()
    }

    /// The run ended in an orderly way for want of room, and was resumed when there was room.
    #[track_caller]
    fn assert_broke_off_and_went_on(&self, why: &str) {
        let said = |path: &Path, what: &str| {
            let text = fs::read_to_string(path.with_extension(what)).expect("by the script");
            text.trim().to_owned()
        };
        let complaint = said(&self.left, "stderr");
        assert_eq!(said(&self.left, "code"), "1", "{complaint}");
        assert!(complaint.contains(why), "{complaint}");
        let names_the_file = complaint.contains(&*self.out.to_string_lossy());
        assert!(names_the_file, "{complaint}");
        assert_eq!(complaint.lines().count(), 1, "{complaint}");

        let whole = assert_only_whole_files(&self.left);
        assert!(whole >= 8, "{whole} files: it never went well");
        assert!(!self.left.join("dataset.json").exists());
        let left = files(&self.left);
        let temporary = left.keys().find(|name| name.ends_with(".tmp"));
        assert_eq!(temporary, None, "a failed write cleans up");

        assert_eq!(said(&self.whole, "stderr"), "");
        assert_eq!(said(&self.whole, "code"), "0");
        assert_same_files(&self.whole, base());
    }
}

#[test]
fn a_full_disk_leaves_whole_files() {
    // Where mounts are not allowed, the file size limit of a process stands in for a full disk.
    let places = Places::new("short_files");
    let request = small(&places.out, &["--quiet"]);
    let mut script = Command::new("sh");
    script.args(["-c", SHORT_FILES, "script"]);
    let ran = outcome(script.args(places.arguments(&request)));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    places.assert_broke_off_and_went_on("File too large");

    let places = Places::new("small_disk");
    let request = small(&places.out, &["--quiet"]);
    if let Some(ran) = with_mounts(SMALL_DISK, &places.arguments(&request)) {
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        places.assert_broke_off_and_went_on("No space left on device");
    }
}

#[test]
fn a_folder_that_cannot_be_written() {
    // Permissions do not stop root, but a file in the place of a folder stops every user.
    let folder = folder("unwritable");
    let file = folder.join("file");
    fs::write(&file, "a file").expect("a writable folder");
    for out in [file.join("out"), file.clone()] {
        let done = outcome(&mut small(&out, &[]));
        assert_unwritable(&done, &out);
    }
    assert_eq!(fs::read(&file).expect("still there"), b"a file");

    // A folder that exists and is empty.
    let out = folder.join("out");
    fs::create_dir(&out).expect("a folder");
    let request = small(&out, &[]);
    let mut arguments = vec![out.as_os_str(), request.get_program()];
    arguments.extend(request.get_args());
    if let Some(done) = with_mounts(READ_ONLY, &arguments) {
        assert_unwritable(&done, &out);
        let message = done.stderr.to_lowercase();
        assert!(message.contains("read-only"), "{}", done.stderr);
    }
}

#[track_caller]
fn assert_unwritable(done: &Outcome, out: &Path) {
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    assert!(done.stderr.starts_with("error: "), "{}", done.stderr);
    let names_it = done.stderr.contains(&*out.to_string_lossy());
    assert!(names_it, "{}", done.stderr);
    assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
}
