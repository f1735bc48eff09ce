// Part B, many indented areas: a thin-walled cast housing with cells, screw bosses and two bores. Millimetres.
$fn = 40;
wall = 3;
height = 26;

module outline() {
  hull() {
    translate([6, 6]) circle(6);
    translate([72, 6]) circle(6);
    translate([72, 36]) circle(6);
    translate([50, 52]) circle(6);
    translate([6, 52]) circle(6);
  }
}

module cells() {
  difference() {
    offset(delta = -wall) outline();
    translate([38, -1]) square([wall, 70]);
    translate([-1, 29]) square([40, wall]);
    translate([39, 22]) square([50, wall]);
  }
}

bosses = [[7.5, 7.5], [70.5, 7.5], [7.5, 50.5], [50.5, 50]];

difference() {
  union() {
    difference() {
      linear_extrude(height) outline();
      translate([0, 0, 4]) linear_extrude(height) cells();
    }
    for (b = bosses) translate(b) cylinder(d = 10.4, h = height);
    translate([21, 16, 0]) cylinder(d = 18, h = 14);
    translate([57, 34, 0]) cylinder(d = 14, h = 19);
    translate([56, -3, 6]) cube([12, 5, 14]);  // sensor pad on one outer wall
  }
  for (b = bosses) translate([b.x, b.y, 10]) cylinder(d = 5, h = height);
  translate([21, 16, -1]) cylinder(d = 11, h = height);
  translate([57, 34, 6]) cylinder(d = 8, h = height);
  translate([22, 42, -1]) cylinder(d = 7, h = 9);
}
