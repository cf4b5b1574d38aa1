# graph.gp: LOA's cost over the number of poses, from the files that bench_graph --data writes: `loa` of --only-loa,
# `all` with the optimisers.
# gnuplot -e "loa='loa.dat'; all='graph.dat'; out='loa-cost.svg'" graph.gp
set terminal svg size 760,330 font 'DejaVu Sans,12' noenhanced background 'white'
set output out
set grid lc rgb '#dddddd' lw 1 lt 1
set border 3 lc rgb '#666666'
set tics nomirror textcolor rgb '#333333'
set xlabel 'poses (1000 loops)'
set format x '%.0s %c'
set multiplot layout 1,2
set key top left reverse Left samplen 2 textcolor rgb '#333333'
set xrange [0:*]
set yrange [0:*]
set ylabel 'processor time [ms]'
line(n) = a + b * n
a = 1
b = 1e-4
set fit quiet nolog
fit line(x) loa using 1:2 via a, b
plot line(x) with lines dt 2 lc rgb '#999999' title sprintf('%.1f ms + %.0f ns a pose', a, 1e6 * b), \
     loa using 1:2 with points pt 7 ps 0.7 lc rgb '#0072b2' title 'LOA, one loop, four costs'
set logscale xy
set xrange [10000:120000]
set yrange [0.001:1000]
set xtics (12500, 25000, 50000, 100000)
set ylabel 'processor time [s], logarithmic'
plot all using 1:3 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#d55e00' title 'gn, all loops', \
     all using 1:4 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#009e73' title 'TORO, all loops', \
     all using 1:5 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#cc79a7' title 'HOG-Man, all loops', \
     all using 1:($2/1000) with linespoints pt 7 ps 0.6 lw 2 lc rgb '#0072b2' title 'LOA, one loop'
unset multiplot
