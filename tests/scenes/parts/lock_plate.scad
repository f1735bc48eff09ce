// Part C, flat: a plate whose outline, slots and holes alone tell one pose from another. Millimetres.
$fn = 48;

linear_extrude(5) difference() {
  union() {
    translate([4, 4]) offset(4) square([58, 30]);
    hull() {
      translate([56, 30]) circle(8);
      translate([60, 46]) circle(6);
    }
  }
  hull() for (x = [14, 32]) translate([x, 12]) circle(d = 7);
  translate([60, 46]) circle(d = 5);
  translate([50, 16]) circle(d = 13);
  translate([22, 28]) square([12, 20]);  // notch open to the edge
  translate([-5, 24]) rotate(45) square([12, 12], center = true);
}
