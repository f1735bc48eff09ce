// Part A, few indented areas: a foot with an off-centre bearing eye, stiffened on one side. Millimetres.
$fn = 48;

module slot(x, y, length, d) {
  hull() for (s = [-1, 1]) translate([x + s * length / 2, y]) circle(d = d);
}

module foot() {
  linear_extrude(9) difference() {
    union() {
      translate([4, 4]) offset(4) square([66, 26]);
      translate([46, 26]) offset(3) square([18, 14]);  // lug, only on this side
    }
    translate([9, 17]) circle(d = 8);
    slot(62, 21, 6, 8);
    translate([55, 36]) circle(d = 5.5);
  }
}

module eye() {
  translate([30, 8, 0]) rotate([90, 0, 0]) translate([0, 0, -22]) linear_extrude(24) difference() {
    union() {
      translate([0, 34]) circle(d = 26);
      polygon([[-13, 34], [-15, 4], [15, 4], [13, 34]]);
    }
    translate([0, 34]) circle(d = 15);
  }
}

module rib() {
  translate([0, 12, 0]) rotate([90, 0, 0]) linear_extrude(6) polygon([[40, 6], [58, 6], [58, 10], [42, 32], [38, 32], [38, 6]]);
}

module grease_boss() {
  translate([30, 18, 46]) difference() {
    translate([0, 0, -4]) cylinder(d = 9, h = 7);
    translate([0, 0, -1]) cylinder(d = 4, h = 5);
  }
}

difference() {
  union() {
    foot();
    eye();
    rib();
    grease_boss();
  }
  translate([30, 17, 34]) rotate([90, 0, 0]) cylinder(d = 15, h = 60, center = true);
}
