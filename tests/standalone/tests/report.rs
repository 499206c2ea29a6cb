//! Use of `nemoral-report` alone: what it refuses is told by type.

use nemoral_report::{Error, report};

#[test]
fn a_page_is_html() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let wrong = report(folder.path(), &folder.path().join("page.pdf"));
    assert!(matches!(wrong, Err(Error::Name { .. })), "{wrong:?}");
    let none = report(folder.path(), &folder.path().join("page.html"));
    assert!(matches!(none, Err(Error::Dataset(_))), "{none:?}");
    Ok(())
}
