// Part D, turned: collar, journal, groove, taper and a blind bore. Millimetres.
rotate_extrude($fn = 64) polygon([
  [0, 0], [10, 0], [11, 1], [11, 16], [16, 16], [17, 17], [17, 22], [12, 23], [12, 34], [9.5, 34], [9.5, 37.5],
  [12, 37.5], [12, 42], [7.5, 62], [7.5, 69], [6.5, 70], [4, 70], [4, 52], [0, 50],
]);
