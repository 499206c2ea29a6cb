//! The communities of closed vegetation that a config asks for.

use nemoral_stand::CommunityParams;

use crate::config;

/// The swards and thickets of a config.
///
/// Without streams and ponds there are no reeds.
pub(crate) fn community_params(of: &config::Undergrowth, water: &config::Water) -> CommunityParams {
    let (s, t) = (&of.sward, &of.thickets);
    let reeds = if water.has_beds() { t.reeds } else { 0.0 };
    CommunityParams {
        sward: s.cover,
        grasses: [s.rank, s.grazed, s.tussocks, s.dry, s.lodged],
        thickets: [t.bramble, t.bracken, t.heath, t.bilberry, t.nettles, reeds],
    }
}
