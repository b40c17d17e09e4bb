//! `--help` of `relit-extract` and its verbs. After a change of the command line:
//! `RELIT_WRITE_HELP=1 cargo test -p relit-extract --test help`.

use std::path::Path;

use relit_test_support::help::assert_help;

#[test]
fn the_help_is_what_the_file_holds() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/relit-extract.txt");
    assert_help(env!("CARGO_BIN_EXE_relit-extract"), &file, &[]);
}
