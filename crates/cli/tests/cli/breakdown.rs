//! Runs that break off: Ctrl-C, kill, a full disk. What they leave is whole, and goes on.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::common::{
    assert_only_whole_files, assert_same_files, base, folder, nemoral, outcome, record, small,
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

/// Starts a run, waits until it has added frames to those that are there, and signals it.
fn signalled(command: &mut Command, out: &Path, signal: &str) -> Child {
    let before = recorded(out);
    let mut child = command
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let started = Instant::now();
    while recorded(out) <= before {
        let ended = child.try_wait().expect("a child");
        assert!(ended.is_none(), "ended by itself: {ended:?}");
        assert!(started.elapsed() < Duration::from_secs(300), "no frame");
        sleep(Duration::from_millis(1));
    }
    let kill = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(kill.expect("kill runs").success());
    child
}

#[test]
fn ctrl_c_and_kill_leave_a_data_set_that_goes_on() {
    let out = folder("interrupted").join("out");

    let child = signalled(&mut small(&out, &[]), &out, "-INT");
    let ended = child.wait_with_output().expect("it ends");
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains("interrupted") && stderr.contains("--resume"),
        "{stderr}"
    );
    let after_ctrl_c = recorded(&out);
    assert!((1..40).contains(&after_ctrl_c), "{after_ctrl_c} frames");
    assert!(!out.join("dataset.json").exists(), "it is not finished");
    let whole = assert_only_whole_files(&out);
    assert!(whole >= 8 * after_ctrl_c, "{whole} files");

    // Without a word about what to do with it, it is left alone.
    let again = outcome(&mut small(&out, &[]));
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("unfinished"), "{}", again.stderr);

    let mut child = signalled(&mut small(&out, &["--resume"]), &out, "-KILL");
    assert_eq!(child.wait().expect("it ends").code(), None, "killed");
    let after_kill = recorded(&out);
    assert!(after_kill > after_ctrl_c, "{after_kill} frames");
    assert_only_whole_files(&out);

    record(&out, &["--resume"]);
    assert_same_files(&out, base());
    // Once more: there is nothing left to do, and nothing changes.
    record(&out, &["--resume"]);
    assert_same_files(&out, base());
}

/// Records on a file system of 600 kB, enlarges it, goes on. Exit codes: 77 if the system lets us
/// make no file system, else 0; what the program said and left is copied out.
const FULL_DISK: &str = r#"
disk=$1 left=$2 whole=$3; shift 3
mount -t tmpfs -o size=600k none "$disk" || exit 77
"$@" 2>"$left.stderr"
echo $? >"$left.code"
cp -a "$disk/out" "$left" || exit 1
mount -o remount,size=64m "$disk" || exit 1
"$@" --resume 2>"$whole.stderr"
echo $? >"$whole.code"
cp -a "$disk/out" "$whole" || exit 1
"#;

/// Says why a test did nothing, even where the output of tests is captured.
fn skipped(why: &str) {
    let mut stderr = std::io::stderr();
    let _ = writeln!(stderr, "\nSKIPPED: the full-disk test: {why}");
}

#[test]
fn a_full_disk_leaves_whole_files() {
    let folder = folder("full_disk");
    let (disk, left, whole) = (
        folder.join("disk"),
        folder.join("left"),
        folder.join("whole"),
    );
    fs::create_dir(&disk).expect("a folder");
    let request = small(&disk.join("out"), &["--quiet"]);
    // A mount namespace of its own: no mount stays behind, whatever happens. Whoever is not root
    // is so in a user namespace, where the system allows those.
    let is_root = outcome(Command::new("id").arg("-u")).stdout.trim() == "0";
    let namespace = if is_root { "-m" } else { "-rm" };
    let mut script = Command::new("unshare");
    script
        .args([namespace, "sh", "-c", FULL_DISK, "full-disk"])
        .args([&disk, &left, &whole])
        .arg(nemoral().get_program())
        .args(request.get_args())
        .stdin(Stdio::null());
    let Ok(ran) = script.output() else {
        return skipped("there is no `unshare` to make a small file system with");
    };
    let stderr = String::from_utf8_lossy(&ran.stderr);
    if ran.status.code() == Some(77) || stderr.starts_with("unshare:") {
        let in_ci = std::env::var("CI").is_ok_and(|v| v == "true");
        assert!(!(in_ci && is_root), "no small file system in CI: {stderr}");
        return skipped(stderr.trim());
    }
    assert!(ran.status.success(), "{stderr}");

    let said = |path: &Path, what: &str| {
        let text = fs::read_to_string(path.with_extension(what)).expect("written by the script");
        text.trim().to_owned()
    };
    let complaint = said(&left, "stderr");
    assert_eq!(said(&left, "code"), "1", "{complaint}");
    assert!(complaint.contains("No space left on device"), "{complaint}");
    assert!(
        complaint.contains(&*disk.to_string_lossy()),
        "names the file: {complaint}"
    );
    assert_eq!(complaint.lines().count(), 1, "{complaint}");

    let whole_files = assert_only_whole_files(&left);
    assert!(whole_files >= 8, "{whole_files}: the disk was full at once");
    assert!(!left.join("dataset.json").exists());
    let half = crate::common::files(&left);
    let temporary = half.keys().find(|name| name.ends_with(".tmp"));
    assert_eq!(temporary, None, "a failed write cleans up");

    // With room again it goes on.
    assert_eq!(said(&whole, "code"), "0", "{}", said(&whole, "stderr"));
    assert_same_files(&whole, base());
}
