% Search by the `ga` of GNU Octave's package: candidates go out on a line each, fitness comes in.
% Options as in the thesis, as far as the package knows them. Read by benchmarks/search.py.
pkg load ga

function fitness = told (candidates)
  fitness = zeros (rows (candidates), 1);
  for row = 1:rows (candidates)
    printf ("ask%s\n", sprintf (" %.17g", candidates(row, :)));
    fflush (stdout);
    line = fgetl (stdin);  % looks one character ahead: each line but the first four begins with #
    fitness(row) = str2double (line(2:end));
  endfor
endfunction

settings = str2num (fgetl (stdin));  % seed, population, generations
lower = str2num (fgetl (stdin));
upper = str2num (fgetl (stdin));
first = str2num (fgetl (stdin));
rand ("twister", settings(1));
randn ("twister", settings(1));
options = gaoptimset ("PopulationSize", settings(2), "Generations", settings(3), ...
                      "EliteCount", 1, "CrossoverFraction", 0.5, ...
                      "InitialPopulation", first, "PopInitRange", [lower; upper]);
ga (@told, columns (lower), [], [], [], [], lower, upper, [], options);
