// Orders of the list: by a column of the samples, or by a number of the chosen run; each is made once.
const ORDERS = { question: "title", type: "kind", trajectory: "cluster", seconds: null, tokens: null };

const orderOf = (() => {
  const made = new Map();
  const numberOf = (result, name) => ({
    seconds: result.seconds ?? 0, tokens: result.tokens?.[0] ?? undefined,
  })[name] ?? result.scores?.[name];
  // Of any run the highest number counts; of several members their sum.
  const highest = (sample, name, run) => {
    const places = run === "" ? ofSuite(sample).map(([, at]) => at) : [Number(run)];
    const numbers = places.map(at => {
      const known = membersOf(sample).map(member => member.results[at]).filter(Boolean).map(result => numberOf(result, name));
      return known.length && known.every(number => number !== undefined) ? sum(known) : undefined;
    }).filter(number => number !== undefined);
    return numbers.length ? Math.max(...numbers) : undefined;
  };
  const sortBy = (name, run) => {
    const field = ORDERS[name];
    const values = samples.map(field ? sample => sample[field] ?? "" : sample => highest(sample, name, run));
    const known = [...samples.keys()].filter(at => values[at] !== undefined);
    known.sort((one, other) => (values[one] < values[other] ? -1 : values[one] > values[other] ? 1 : one - other));
    return [known, [...samples.keys()].filter(at => values[at] === undefined)];
  };
  return (name, run, isDescending) => {
    if (!name) return [...samples.keys()];
    const key = ORDERS[name] ? name : `${name}\n${run}`;
    if (!made.has(key)) made.set(key, sortBy(name, run));
    const [known, unknown] = made.get(key); // samples without a value are last, whichever way
    return [...(isDescending ? known.toReversed() : known), ...unknown];
  };
})();
