import numpy as np
from box_sites import box_site

from bimvox.planning.occupancy import Occupancy
from bimvox.site.collision import grown_cells, in_transit, margin_vox, placement_is_free
from bimvox.site.site import Rules


def test_whole_cells_are_kept():
    for margin_m, cells in ((0.0, 0), (0.1, 1), (0.5, 1), (0.6, 2)):
        site = box_site([("a", (1, 1, 0), (2, 2, 1))], rules=Rules(transit_clearance_m=margin_m))
        assert margin_vox(site) == cells


def test_grown_boxes_and_grown_cells_say_the_same():
    site = box_site([("a", (1, 1, 0), (3, 2, 1))], structure=[("post", (8, 7, 0), (8.5, 7.5, 4))])
    component = site.components[0]
    free = Occupancy(site).space(component)
    for margin in (0, 1, 2):
        rule, own = in_transit(free, margin), grown_cells(component.shape.cells, margin)
        occupied = Occupancy(site).counts > 0
        for place in [(5, 5, 4), (12, 14, 4), (14, 14, 6), (16, 10, 3), (11, 10, 5), (18, 18, 4)]:
            cells = own + np.array(place)
            assert placement_is_free(rule, *place) == (not occupied[tuple(cells.T)].any())
