use super::Serving;
use crate::serve::page;

#[test]
fn the_page_and_its_files_are_served_and_need_nothing_else() {
    let serving = Serving::start();
    let index = serving.get("/");
    assert_eq!(
        index.header("content-type"),
        Some("text/html; charset=utf-8")
    );
    let index = String::from_utf8(index.body).unwrap();
    for asset in &page::ASSETS {
        let answer = serving.get(asset.path);
        assert_eq!(
            answer.header("content-type"),
            Some(asset.kind),
            "{}",
            asset.path
        );
        assert_eq!(answer.body, asset.text.as_bytes());
    }
    // The policy allows no script or style in the page itself, and nothing from elsewhere.
    for forbidden in [
        "<style", "style=", "onclick", "https://", "http://", "<script>",
    ] {
        assert!(!index.contains(forbidden), "{forbidden}");
    }
}

#[test]
fn scripts_set_text_never_markup_and_look_only_for_what_the_page_has() {
    let index = include_str!("../page/index.html");
    let scripts = page::ASSETS
        .iter()
        .filter(|asset| asset.path.ends_with(".js"));
    for script in scripts {
        for forbidden in [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
        ] {
            assert!(
                !script.text.contains(forbidden),
                "{forbidden} in {}",
                script.path
            );
        }
        for opening in ["$(\"", "getElementById(\""] {
            for piece in script.text.split(opening).skip(1) {
                let id = piece.split('"').next().unwrap();
                assert!(
                    index.contains(&format!("id=\"{id}\"")),
                    "{id} in {}",
                    script.path
                );
            }
        }
    }
}
