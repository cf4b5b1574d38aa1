# graph.gp: LOA's cost over the number of poses, from the files that bench_graph --data writes: `many` and `few` of
# --only-loa with 1000 and with 100 loops, `all` with the optimisers.
# gnuplot -e "many='loa_1000.dat'; few='loa_100.dat'; all='graph.dat'; out='loa-cost.svg'" graph.gp
set terminal svg size 760,330 font 'DejaVu Sans,12' noenhanced background 'white'
set output out
set grid lc rgb '#dddddd' lw 1 lt 1
set border 3 lc rgb '#666666'
set tics nomirror textcolor rgb '#333333'
set xlabel 'poses'
set xtics 200000
set format x '%.0s %c'
set multiplot layout 1,2
set key top left reverse Left samplen 2 textcolor rgb '#333333'
set xrange [0:*]
set yrange [0:*]
set ylabel 'processor time of LOA, one loop [ms]'
line_many(n) = a_many + b_many * n
line_few(n) = a_few + b_few * n
a_many = 5; b_many = 1e-4; a_few = 1; b_few = 1e-4
set fit quiet nolog
fit line_many(x) many using 1:2 via a_many, b_many
fit line_few(x) few using 1:2 via a_few, b_few
a_few = a_few > 0.05 ? a_few : 0  # not -0.0
plot many using 1:2 with points pt 7 ps 0.7 lc rgb '#0072b2' \
       title sprintf('1000 loops: %.1f ms + %.0f ns a pose', a_many, 1e6 * b_many), \
     line_many(x) with lines dt 2 lc rgb '#0072b2' notitle, \
     few using 1:2 with points pt 7 ps 0.7 lc rgb '#56b4e9' \
       title sprintf('100 loops: %.1f ms + %.0f ns a pose', a_few, 1e6 * b_few), \
     line_few(x) with lines dt 2 lc rgb '#56b4e9' notitle
set xlabel 'poses (1000 loops)'
set logscale xy
set xrange [10000:120000]
set yrange [0.001:1000]
set xtics ('12.5 k' 12500, '25 k' 25000, '50 k' 50000, '100 k' 100000)
set ylabel 'processor time [s], logarithmic'
plot all using 1:3 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#d55e00' title 'gn, all loops', \
     all using 1:4 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#009e73' title 'TORO, all loops', \
     all using 1:5 with linespoints pt 7 ps 0.6 lw 2 lc rgb '#cc79a7' title 'HOG-Man, all loops', \
     all using 1:($2/1000) with linespoints pt 7 ps 0.6 lw 2 lc rgb '#0072b2' title 'LOA, one loop'
unset multiplot
