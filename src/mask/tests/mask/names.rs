//! Files whose names mean something to FFmpeg, to the shell, or to the command line.

use std::fs;

use super::support::{code, photograph, read, relit_mask, said, video};

#[test]
fn the_picture_that_is_named_is_read_whatever_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    photograph(20.0).save(folder.join("plain.png")).unwrap();
    let mask = |name: &str, arguments: &[&str]| {
        let out = ["--rect", "16,4,64,64", "-o", "out.png", "--force"];
        let output = relit_mask(folder, &[&out, arguments].concat());
        assert_eq!(code(&output), 0, "{name}: {}", said(&output));
        read(folder, "out.png")
    };
    let wanted = mask("plain.png", &["plain.png"]);
    // What the names would mean as patterns and protocols.
    for name in ["cup0.png", "cup00.png", "x.png", "a.png", "cup1.png"] {
        photograph(9.0).save(folder.join(name)).unwrap();
    }
    for name in [
        "cup%d.png",
        "cup%02d.png",
        "100%.png",
        "%%.png",
        "cup*.png",
        "cup?.png",
        "cup[0-1].png",
        "http:x.png",
        "concat:a.png|x.png",
        "file:x.png",
        "a:b.png",
        " .png",
        "\u{e4}\u{1f600}.png",
    ] {
        fs::copy(folder.join("plain.png"), folder.join(name)).unwrap();
        assert!(mask(name, &[name]) == wanted, "{name}");
    }
    fs::copy(folder.join("plain.png"), folder.join("-x.png")).unwrap();
    assert!(mask("-x.png", &["./-x.png"]) == wanted);
    assert!(mask("-x.png", &["--", "-x.png"]) == wanted);
}

#[test]
fn the_video_that_is_named_is_read_whatever_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["clip%d.y4m", "pipe:0.y4m", "subfile,,:a.y4m", "[x]?*.y4m"] {
        fs::write(folder.join(name), video()).unwrap();
        let output = relit_mask(
            folder,
            &[name, "--rect", "10,10,60,50", "-o", "m.png", "--force"],
        );
        assert_eq!(code(&output), 0, "{name}: {}", said(&output));
    }
}

#[cfg(unix)]
#[test]
fn a_name_that_is_not_text_is_refused() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = tempfile::tempdir().unwrap();
    let name = OsStr::from_bytes(b"clip\xff.y4m");
    fs::write(folder.path().join(name), video()).unwrap();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_relit-mask"))
        .arg(name)
        .args(["--rect", "10,10,60,50", "-o", "m.png"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(code(&output), 1, "{}", said(&output));
    assert!(said(&output).contains(".y4m"), "{}", said(&output));
    assert!(!folder.path().join("m.png").exists());
}
